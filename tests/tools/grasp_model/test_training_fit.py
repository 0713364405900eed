"""Fitting: whole scenes per fold, a calibration that calibrates, and the same result twice."""

import numpy as np
from training_trials import make_trials

from tools.grasp_model.evaluation import auc, calibration_error
from tools.grasp_model.train import TrainConfig, fit, fold_of, isotonic_knots

QUICK = TrainConfig(trees=40, leaves=7, learning_rate=0.2, folds=4)


def test_folds_keep_scenes_together_and_are_balanced():
    groups = np.repeat(np.arange(23), 7)
    fold = fold_of(groups, 5, seed=0)
    assert all(len(set(fold[groups == g])) == 1 for g in range(23))
    assert np.ptp(np.bincount(fold)) <= 7


def test_isotonic_knots_rise_stay_in_bounds_and_calibrate():
    rng = np.random.default_rng(0)
    p = rng.random(4000)
    held = rng.random(4000) < p**2
    x, y = isotonic_knots(p, held)
    assert x[0] == 0.0
    assert x[-1] == 1.0
    assert (np.diff(x) > 0).all()
    assert (np.diff(y) >= 0).all()
    assert y.min() >= 0.0
    assert y.max() <= 1.0
    q = rng.random(1000)
    assert np.abs(np.interp(q, x, y) - q**2).mean() < 0.03


def test_fit_learns_calibrates_and_repeats():
    trials = make_trials(3000, seed=5, scenes=40)
    a, b = fit(trials, QUICK), fit(trials, QUICK)
    assert np.array_equal(a.p, b.p)
    assert auc(a.p_raw, trials.delivered) > auc(trials.p_hand, trials.delivered) + 0.1
    assert calibration_error(a.p, trials.delivered) < 0.04
    fresh = make_trials(3000, seed=6)
    assert auc(a.predict(fresh.features), fresh.delivered) > 0.85
