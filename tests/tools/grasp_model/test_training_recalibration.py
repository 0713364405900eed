"""Promises are brought in line with what was delivered; first tries alone count; ranks stay."""

import numpy as np
import pytest

from tools.grasp_model.recalibration import Promise, fit_promise, recalibrated
from torc.grasping.features import FEATURE_NAMES
from torc.grasping.scoring import MODEL_PATH
from torc.grasping.trees import load_trees


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
