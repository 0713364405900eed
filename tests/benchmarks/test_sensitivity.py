"""Other worlds are what they say: scenes that are scaled stay in contact, densities and friction are as stated."""

import numpy as np

from benchmarks import sensitivity
from torc.objects.library import load_object
from torc.problems.problem import load_problem
from torc.sim.contacts import deepest_overlap
from torc.sim.world import build_world
from torc.workspace.files import load_workspace


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
