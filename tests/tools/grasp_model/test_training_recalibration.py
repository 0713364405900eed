"""Promises are brought in line with what was delivered; first tries alone count; ranks stay."""

import numpy as np
import pytest

from tools.grasp_model.recalibration import Promise, fit_promise, read_tries, recalibrated
from torc.grasping.features import FEATURE_NAMES
from torc.grasping.scoring import MODEL_PATH
from torc.grasping.trees import load_trees

HEADER = "planner,problem,seed,pick,result,object_id,p\n"


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


def test_only_first_tries_with_an_object_count(tmp_path):
    path = tmp_path / "picks.csv"
    path.write_text(
        HEADER
        + "random,a,0,0,missed,3,0.9\n"
        + "random,a,0,1,removed,3,0.7\n"  # after a failure
        + "random,a,0,2,removed,4,0.8\n"
        + "random,a,1,0,removed,3,0.6\n"  # another trial
        + "random,a,1,1,not reached,5,0.5\n"  # not tried
        + "random,a,1,2,slipped,5,0.4\n"
        + "random,a,1,3,no motion plan,6,\n"
    )
    tries = read_tries([path])
    assert tries.p.tolist() == [0.9, 0.8, 0.6, 0.4]
    assert tries.delivered.tolist() == [False, True, True, False]


def test_the_model_ranks_as_before_and_promises_what_is_kept():
    model, promise = load_trees(MODEL_PATH, FEATURE_NAMES), Promise(-0.5, 0.9, 1.4)
    changed = recalibrated(model, promise, "test")
    x = np.random.default_rng(1).normal(0, 1, (500, len(FEATURE_NAMES))).astype(np.float32)
    before, after = model.score(x), changed.score(x)
    assert np.array_equal(np.argsort(before, kind="stable"), np.argsort(after, kind="stable"))
    knots = np.searchsorted(model.knots_p, model.knots_p)
    np.testing.assert_allclose(changed.knots_held[knots], promise.kept(model.knots_held[knots]))
    assert changed.notes.endswith("test")
