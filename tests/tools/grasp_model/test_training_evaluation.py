"""Measures: against sklearn, against simulation, and at the edges."""

import numpy as np
import pytest
from sklearn import metrics

from tools.grasp_model.evaluation import (
    auc,
    best_per_group,
    brier,
    calibration_error,
    clustered_share,
    log_loss,
    paired_difference,
    permutation_importance,
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


def test_auc_of_one_class_is_nan():
    assert np.isnan(auc(np.array([0.2, 0.4]), np.array([True, True])))


def test_wilson_known_value_and_edges():
    share = wilson(8, 10)
    assert (share.low, share.high) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))
    assert wilson(0, 10).low == 0.0 < wilson(0, 10).high
    assert str(wilson(0, 0)) == "-"


def test_clustered_interval_is_wider_for_correlated_outcomes():
    rng = np.random.default_rng(1)
    cluster = np.repeat(np.arange(40), 10)
    alike = np.repeat(rng.random(40) < 0.6, 10)
    independent = rng.permutation(alike)
    wide, narrow = (clustered_share(h, cluster, np.random.default_rng(2)) for h in (alike, independent))
    assert wide.value == narrow.value
    assert wide.high - wide.low > 1.8 * (narrow.high - narrow.low)


def test_clustered_interval_of_equal_outcomes_has_width():
    share = clustered_share(np.ones(30, bool), np.repeat(np.arange(3), 10), np.random.default_rng(0))
    assert share.value == share.high == 1.0
    assert share.low == pytest.approx(wilson(3, 3).low)


def test_paired_difference_sign():
    a, b = np.array([True, True, False, True] * 10), np.array([False, True, False, False] * 10)
    share = paired_difference(a, b, np.arange(40), np.random.default_rng(0))
    assert share.value == pytest.approx(0.5)
    assert 0 < share.low < 0.5 < share.high


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


def test_permutation_importance_finds_the_feature():
    rng = np.random.default_rng(4)
    x = rng.standard_normal((400, 3))
    loss = permutation_importance(lambda v: v[:, 1], x, x[:, 1] > 0, rng)
    assert np.argmax(loss) == 1
    assert loss[0] == loss[2] == 0
