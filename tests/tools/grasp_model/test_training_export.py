"""The exported file gives scikit-learn's probabilities, and holds nothing but numbers and text."""

import numpy as np
from training_trials import NAMES, make_trials

from tools.grasp_model.export import export
from tools.grasp_model.train import TrainConfig, fit
from torc.grasping.trees import load_trees

QUICK = TrainConfig(trees=30, leaves=9, learning_rate=0.2, folds=3)


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
