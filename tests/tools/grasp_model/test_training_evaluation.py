"""Measures: against sklearn, against simulation, and at the edges."""

import numpy as np
import pytest
from sklearn import metrics

from tools.grasp_model.evaluation import (
    auc,
    best_per_group,
    brier,
    log_loss,
)


@pytest.fixture
def scored():
    rng = np.random.default_rng(0)
    p = np.round(rng.random(500), 2)
    return p, rng.random(500) < p


def test_measures_agree_with_sklearn(scored):
    p, held = scored
    assert auc(p, held) == pytest.approx(metrics.roc_auc_score(held, p), abs=1e-12)
    assert brier(p, held) == pytest.approx(metrics.brier_score_loss(held, p), abs=1e-12)
    inner = np.clip(p, 0.01, 0.99)
    assert log_loss(inner, held) == pytest.approx(metrics.log_loss(held, inner), abs=1e-9)


def test_best_per_group_brute_force():
    rng = np.random.default_rng(3)
    p, group = np.round(rng.random(200), 1), rng.integers(0, 30, 200)
    best = best_per_group(p, group)
    for g, i in zip(np.unique(group), best):
        rows = np.flatnonzero(group == g)
        assert i == rows[np.argmax(p[rows])]
