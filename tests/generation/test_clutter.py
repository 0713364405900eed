"""Clutter is at rest, within reach, off the edge, and the same for the same seed."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from torc.errors import PhysicsError
from torc.generation import clutter
from torc.generation.clutter import (
    LARGE_PILE,
    ClutterConfig,
    ObjectRange,
    again_at_rest,
    astray,
    clutter_config,
    make_clutter,
)
from torc.generation.config import RejectedError
from torc.generation.sampling import sample_models
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem, load_problem
from torc.sim.contacts import Overlap
from torc.sim.settling import UNSEEN, watch_stillness
from torc.sim.simulated_world import build_world
from torc.workspace.workspace_files import load_workspace

WORKSPACE, CONFIG = load_workspace(), ClutterConfig()
WANTED = ObjectRange(5, 7)
NAMES = sample_models(7, np.random.default_rng(1))


def _make(category, seed, wanted=WANTED, models=NAMES, config=CONFIG):
    return make_clutter(list(models), category, wanted, WORKSPACE, np.random.default_rng(seed), config)


@pytest.mark.parametrize("category", ["structured", "unstructured"])
def test_clutter_is_reproducible_calm_and_within_reach(category):
    scene = _make(category, 5)
    assert scene == _make(category, 5)
    assert scene != _make(category, 6)
    assert scene.category == category
    assert 5 <= len(scene.objects) <= 7
    assert astray(scene, WORKSPACE, CONFIG) == ()
    assert watch_stillness(build_world(scene, None, WORKSPACE, UNSEEN), CONFIG.calm).still
    corner = np.array(WORKSPACE.table.center[:2]) - np.array(WORKSPACE.table.size[:2]) / 2
    for placement in scene.objects:
        vertices = np.concatenate([m.vertices for m in load_object(placement.model).visuals])
        points = transform_points(placement.T_world_object, vertices.astype(float))
        assert (points[:, :2] > corner).all()
        assert points[:, 2].min() > WORKSPACE.support_z_m - 0.004


@pytest.mark.slow
def test_large_piles_come_to_rest_within_reach():
    made = []
    for seed in range(3):
        names = sample_models(45, np.random.default_rng(seed))
        with suppress(RejectedError, PhysicsError):
            made.append(
                _make("unstructured", seed, ObjectRange(30, 40), names, clutter_config("unstructured", 32))
            )
    assert len(made) >= 2
    for scene in made:
        assert 30 <= len(scene.objects) <= 40
        assert astray(scene, WORKSPACE, LARGE_PILE) == ()


def test_what_does_not_fit_is_said():
    tiny = replace(CONFIG, region_m=(0.1, 0.1))
    with pytest.raises(RejectedError, match="do not fit"):
        _make("structured", 0, WANTED, config=tiny)


@pytest.mark.parametrize(
    ("x", "y", "strays"),
    [(0.65, -0.12, False), (0.40, -0.12, True), (0.95, -0.12, True), (0.65, 0.30, True)],
)
def test_astray_is_out_of_reach_or_over_the_edge(x, y, strays):
    z = WORKSPACE.support_z_m + 0.05
    scene = Problem(
        "p", "structured", "", "can", (ObjectPlacement("can", "soup_can_red", (x, y, z), (1.0, 0, 0, 0)),)
    )
    assert astray(scene, WORKSPACE, CONFIG) == (("can",) if strays else ())


def test_a_scene_comes_to_rest_again_without_what_was_taken_away():
    scene = load_problem("unstructured-03")
    gone = (scene.objects[2].name, scene.objects[5].name)
    again = again_at_rest(scene, gone, ObjectRange(6, 20), WORKSPACE, CONFIG)
    assert not set(gone) & {o.name for o in again.objects}
    with pytest.raises(RejectedError, match="too few"):
        again_at_rest(scene, gone, ObjectRange(12, 20), WORKSPACE, CONFIG)


@pytest.mark.parametrize("fewest", [5, 12])
def test_of_two_that_are_wedged_the_higher_one_is_taken_away_if_it_can_be_spared(monkeypatch, fewest):
    scene, wedged = load_problem("unstructured-03"), (2, 7)
    names = [scene.ordered()[k].name for k in wedged]
    assert len(scene.objects) == 12
    first = iter([Overlap(0.003, ("", ""), wedged)])
    monkeypatch.setattr(clutter, "deepest_overlap", lambda world: next(first, Overlap(0.0)))
    if fewest == 12:
        with pytest.raises(RejectedError, match="pressed into each other"):
            again_at_rest(scene, (), ObjectRange(fewest, 20), WORKSPACE, CONFIG)
        return
    again = again_at_rest(scene, (), ObjectRange(fewest, 20), WORKSPACE, CONFIG)
    heights = {o.name: o.position[2] for o in scene.objects}
    higher, lower = sorted(names, key=heights.__getitem__, reverse=True)
    left = [o.name for o in again.objects]
    assert higher not in left
    assert lower in left
