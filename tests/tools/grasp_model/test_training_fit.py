"""Fitting, measures, calibration and export: against brute force, scikit-learn and simulation."""

import numpy as np
import pytest
from sklearn import metrics
from training_trials import NAMES, make_trials

from tools.grasp_model.evaluation import (
    auc,
    best_per_group,
    brier,
    calibration_error,
    log_loss,
)
from tools.grasp_model.export import export
from tools.grasp_model.recalibration import Promise, fit_promise, recalibrated
from tools.grasp_model.train import TrainConfig, fit, fold_of, isotonic_knots
from torc.grasping.features import FEATURE_NAMES
from torc.grasping.geometric_planner import MODEL_PATH
from torc.grasping.trees import load_trees

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
    assert (x[0], x[-1]) == (0.0, 1.0)
    assert (np.diff(x) > 0).all()
    assert (np.diff(y) >= 0).all()
    assert 0.0 <= y.min() <= y.max() <= 1.0
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


def test_export_equals_sklearn(tmp_path):
    trials = make_trials(1500, seed=1)
    path = tmp_path / "data" / "model.npz"
    fitted = fit(trials, QUICK)
    assert export(fitted, trials, path) < 1e-6
    fresh = make_trials(2000, seed=2).features
    fresh[::7, 0] = np.nan
    fresh[::11, 1] *= 100
    ours = load_trees(path, NAMES).score(fresh)
    assert np.abs(ours - fitted.predict(fresh)).max() < 1e-6
    assert np.ptp(ours) > 0.5


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


@pytest.mark.parametrize("made", [Promise(0.0, 1.0, 1.0), Promise(-0.6, 0.8, 1.8), Promise(0.4, 1.5, 0.7)])
def test_the_numbers_that_made_the_outcomes_are_found(made):
    rng = np.random.default_rng(0)
    p = rng.beta(4, 1, 40_000)
    delivered = rng.random(len(p)) < made.kept(p)
    found = fit_promise(p, delivered)
    assert found.shift == pytest.approx(made.shift, abs=0.08)
    assert found.slope == pytest.approx(made.slope, abs=0.08)
    assert found.slope_above == pytest.approx(made.slope_above, rel=0.15)
    for low, high in ((0.3, 0.6), (0.6, 0.9), (0.9, 1.0)):
        some = (p >= low) & (p < high)
        assert found.kept(p[some]).mean() == pytest.approx(delivered[some].mean(), abs=0.03)


def test_the_model_ranks_as_before_and_promises_what_is_kept():
    model, promise = load_trees(MODEL_PATH, FEATURE_NAMES), Promise(-0.5, 0.9, 1.4)
    changed = recalibrated(model, promise, "test")
    x = np.random.default_rng(1).normal(0, 1, (500, len(FEATURE_NAMES))).astype(np.float32)
    before, after = model.score(x), changed.score(x)
    assert np.array_equal(np.argsort(before, kind="stable"), np.argsort(after, kind="stable"))
    knots = np.searchsorted(model.knots_p, model.knots_p)
    np.testing.assert_allclose(changed.knots_held[knots], promise.kept(model.knots_held[knots]))
    assert changed.notes.endswith("test")


def test_the_promise_for_rough_depth_is_brought_in_line_alone():
    model, promise = load_trees(MODEL_PATH, FEATURE_NAMES), Promise(-0.5, 0.9, 1.4)
    once = recalibrated(model, promise, "test", rough=True)
    assert np.array_equal(once.knots_held, model.knots_held)
    was = model.for_rough_depth().knots_held
    np.testing.assert_allclose(once.knots_rough, promise.kept(was))
    twice = recalibrated(once, promise, "test", rough=True)
    np.testing.assert_allclose(twice.knots_rough, promise.kept(promise.kept(was)))
