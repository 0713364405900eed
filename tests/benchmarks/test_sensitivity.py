"""Other worlds are what they say: scenes that are scaled stay in contact, densities and friction are as stated."""

import numpy as np
import pytest

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


@pytest.mark.parametrize("name", ["mug_red", "tuna_can_blue", "banana_red"])
def test_objects_have_the_stated_density_size_and_friction(name):
    model = load_object(name)
    volume = sum(p.volume_m3 for p in model.pieces)
    light = sensitivity.changed_model(model, sensitivity.CONDITIONS["light"])
    assert light.mass_kg == pytest.approx(50.0 * volume)
    large = sensitivity.changed_model(model, sensitivity.CONDITIONS["large"])
    assert large.mass_kg == pytest.approx(1.2**3 * model.mass_kg)
    assert sum(p.volume_m3 for p in large.pieces) == pytest.approx(1.2**3 * volume, rel=1e-6)
    np.testing.assert_allclose(large.size_m, 1.2 * np.array(model.size_m))
    assert sensitivity.changed_model(model, sensitivity.CONDITIONS["slippery"]).friction == model.friction / 2
    same = sensitivity.changed_model(model, sensitivity.CONDITIONS["as-it-is"])
    assert (same.mass_kg, same.friction, same.size_m) == (model.mass_kg, model.friction, model.size_m)
