"""The fit of what a failure says about an object."""

import numpy as np
import pytest
from scipy.special import expit, logit

from benchmarks import failure_memory as memory
from benchmarks import missing_depth, sensitivity
from benchmarks import vlm_calibration as calibration
from benchmarks.processes import run_jobs
from torc.objects.library import load_object
from torc.problems.problem import load_problem
from torc.sim.contacts import deepest_overlap
from torc.sim.simulated_world import build_world
from torc.vlm.simulated.situation import Situation
from torc.workspace.workspace_files import load_workspace


def test_the_fit_finds_what_the_failures_took(rng):
    n = 6000
    p, failures = rng.uniform(0.3, 0.99, n), rng.integers(0, 4, n).astype(float)
    delivered = (rng.random(n) < expit(logit(p) - 0.7 * failures)).astype(float)
    problems = [f"problem-{k}" for k in rng.integers(0, 30, n)]
    found = memory.fit(p, failures, delivered, problems)
    assert found.low < 0.7 < found.high
    assert found.high - found.low < 0.2


def test_damages_take_what_they_say(rng):
    depth_m = np.full((240, 320), 1.0, np.float32)
    depth_m[:, 160:] = 0.8
    for share in (0.01, 0.05):
        assert np.mean(missing_depth.speckles(share)(depth_m, rng)) == pytest.approx(share, rel=0.2)
        assert np.mean(missing_depth.blobs(share)(depth_m, rng)) == pytest.approx(share, rel=0.1)
    for px in (1, 2, 3):
        assert np.flatnonzero(missing_depth.edges(px)(depth_m, rng)[100]).tolist() == list(
            range(160 - px, 160 + px)
        )


def test_a_scaled_scene_is_the_same_scene_larger():
    workspace, larger = load_workspace(), sensitivity.CONDITIONS["large"]
    problem = load_problem("validation-unstructured-01")
    scaled = sensitivity.scaled_problem(problem, larger.scale, workspace.support_z_m)
    before = np.array([o.position for o in problem.ordered()])
    after = np.array([o.position for o in scaled.ordered()])
    gaps = np.linalg.norm(before[:, None] - before, axis=2)
    np.testing.assert_allclose(np.linalg.norm(after[:, None] - after, axis=2), 1.2 * gaps, atol=1e-9)
    np.testing.assert_allclose(
        after[:, 2] - workspace.support_z_m, 1.2 * (before[:, 2] - workspace.support_z_m), atol=1e-9
    )
    world = build_world(
        scaled, None, workspace, load_model=lambda name: sensitivity.changed_model(load_object(name), larger)
    )
    assert deepest_overlap(world).depth_m < 0.002


def test_jobs_run_in_processes_of_their_own(capfd):
    run_jobs("{}-{}".format, [("a", 1), ("b", 2)], workers=2)
    lines = capfd.readouterr().out.splitlines()
    assert sorted(line.split()[1] for line in lines) == ["a-1", "b-2"]
    assert [line.split()[0] for line in lines] == ["[1/2]", "[2/2]"]


SITUATION = Situation(
    in_sight={0: 200, 1: 900, 2: 400},
    graspable=frozenset({2}),
    lies_on=frozenset({(2, 1)}),
    hides={(1, 0): 150},
    blocks=frozenset({(1, 0)}),
    near=frozenset({(0, 1), (1, 2), (0, 2)}),
)


def test_the_share_of_lost_picks_is_that_of_playing_on_until_none_is_lost(rng):
    p = np.array([0.9, 0.5, 0.2])
    lost = picks = 0
    for chance in np.tile(p, 3000):
        while not (rng.random(3) < chance).any():
            lost, picks = lost + 1, picks + 1
        picks += 1
    assert calibration.lost_share(p) == pytest.approx(lost / picks, abs=0.02)
    assert calibration.lost_share(np.zeros(2)) == pytest.approx(15 / 16)


def test_geometry_is_right_where_it_says_what_is_so():
    row = calibration.plain(SITUATION)
    true = [(0, "behind", 1), (1, "below", 2)]
    assert calibration.geometric_accuracy([{**row, "by_geometry": true}]) == (1.0, 1.0)
    # A pair turned round is wrong in both directions; of four directions of two pairs that is a half.
    turned = [(1, "behind", 0), (1, "below", 2)]
    assert calibration.geometric_accuracy([{**row, "by_geometry": turned}]) == (0.5, 1.0)
    missed = [(0, "behind", 1), (1, "behind", 2)]
    assert calibration.geometric_accuracy([{**row, "by_geometry": missed}]) == (1.0, pytest.approx(2 / 3))
