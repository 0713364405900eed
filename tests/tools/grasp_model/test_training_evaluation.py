"""Measures: against sklearn, against simulation, and at the edges."""

import numpy as np
import pytest
from sklearn import metrics

from tools.grasp_model.evaluation import (
    auc,
    best_per_group,
    brier,
    calibration_error,
    log_loss,
    reliability,
    wilson,
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


def test_wilson_known_value_and_edges():
    share = wilson(8, 10)
    assert (share.low, share.high) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))
    assert wilson(0, 10).low == 0.0 < wilson(0, 10).high
    assert str(wilson(0, 0)) == "-"


def test_reliability_covers_every_trial(scored):
    p, held = scored
    bins = reliability(np.append(p, 1.0), np.append(held, True))
    assert sum(b.held.count for b in bins) == 501
    assert all(b.low <= b.mean_p <= b.high for b in bins)
    assert calibration_error(p, held) < 0.1 < calibration_error(1 - p, held)


def test_best_per_group_brute_force():
    rng = np.random.default_rng(3)
    p, group = np.round(rng.random(200), 1), rng.integers(0, 30, 200)
    best = best_per_group(p, group)
    for g, i in zip(np.unique(group), best):
        rows = np.flatnonzero(group == g)
        assert i == rows[np.argmax(p[rows])]
