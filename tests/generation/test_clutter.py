"""Clutter is at rest, within reach, off the edge, and the same for the same seed."""

from dataclasses import replace

import numpy as np
import pytest

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
from torc.generation.rejections import Reason
from torc.generation.sampling import sample_models
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem, load_problem
from torc.sim.contacts import Overlap
from torc.sim.settling import UNSEEN
from torc.sim.stillness import StillnessReport, watch_stillness
from torc.sim.world import build_world
from torc.workspace.files import load_workspace

WORKSPACE, CONFIG = load_workspace(), ClutterConfig()
WANTED = ObjectRange(5, 7)
NAMES = sample_models(7, np.random.default_rng(1))


def _make(category, seed, wanted=WANTED, models=NAMES, config=CONFIG):
    return make_clutter(list(models), category, wanted, WORKSPACE, np.random.default_rng(seed), config)


@pytest.mark.parametrize("category", ["structured", "unstructured"])
def test_clutter_is_reproducible_calm_and_within_reach(category):
    scene = _make(category, 5)
    assert isinstance(scene, Problem)
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
        made.append(
            _make("unstructured", seed, ObjectRange(30, 40), names, clutter_config("unstructured", 32))
        )
    scenes = [scene for scene in made if isinstance(scene, Problem)]
    assert len(scenes) >= 2
    for scene in scenes:
        assert 30 <= len(scene.objects) <= 40
        assert astray(scene, WORKSPACE, LARGE_PILE) == ()


def test_what_does_not_fit_is_said():
    tiny = replace(CONFIG, region_m=(0.1, 0.1))
    assert _make("structured", 0, WANTED, config=tiny) is Reason.DOES_NOT_FIT


@pytest.mark.parametrize(
    ("x", "y", "strays"),
    [(0.65, -0.12, False), (0.40, -0.12, True), (0.44, -0.12, True), (0.95, -0.12, True), (0.65, 0.30, True)],
)
def test_astray_is_out_of_reach_or_over_the_edge(x, y, strays):
    z = WORKSPACE.support_z_m + 0.05
    scene = Problem(
        "p", "structured", "", "can", (ObjectPlacement("can", "soup_can_red", (x, y, z), (1.0, 0, 0, 0)),)
    )
    assert astray(scene, WORKSPACE, CONFIG) == (("can",) if strays else ())


def test_a_long_thing_over_the_edge_is_astray_though_its_middle_is_not():
    placed = ObjectPlacement(
        "hammer",
        "hammer_blue",
        (0.47, -0.1, WORKSPACE.support_z_m + 0.02),
        (np.sqrt(0.5), 0, 0, np.sqrt(0.5)),
    )
    scene = Problem("p", "structured", "", "hammer", (placed,))
    assert astray(scene, WORKSPACE, CONFIG) == ("hammer",)
    along = Problem("p", "structured", "", "hammer", (replace(placed, wxyz=(1.0, 0, 0, 0)),))
    assert astray(along, WORKSPACE, replace(CONFIG, edge_m=-0.01)) == ()


def test_a_scene_comes_to_rest_again_without_what_was_taken_away():
    scene = load_problem("unstructured-03")
    gone = (scene.objects[2].name, scene.objects[5].name)
    again = again_at_rest(scene, gone, ObjectRange(6, 20), WORKSPACE, CONFIG)
    assert isinstance(again, Problem)
    assert not set(gone) & {o.name for o in again.objects}
    assert again_at_rest(scene, gone, ObjectRange(12, 20), WORKSPACE, CONFIG) is Reason.TOO_FEW_LEFT


@pytest.mark.parametrize("fewest", [5, 12])
def test_of_two_that_are_wedged_the_higher_one_is_taken_away_if_it_can_be_spared(monkeypatch, fewest):
    scene, wedged = load_problem("unstructured-03"), (2, 7)
    names = [scene.ordered()[k].name for k in wedged]
    assert len(scene.objects) == 12
    first = iter([Overlap(0.003, ("", ""), wedged)])
    monkeypatch.setattr(clutter, "deepest_overlap", lambda world: next(first, Overlap(0.0)))
    again = again_at_rest(scene, (), ObjectRange(fewest, 20), WORKSPACE, CONFIG)
    if fewest == 12:
        assert again is Reason.WEDGED
        return
    assert isinstance(again, Problem)
    heights = {o.name: o.position[2] for o in scene.objects}
    higher, lower = sorted(names, key=heights.__getitem__, reverse=True)
    left = [o.name for o in again.objects]
    assert higher not in left
    assert lower in left


def test_what_creeps_on_with_nothing_to_spare_is_given_up_soon(monkeypatch):
    scene, watches = load_problem("structured-04"), []

    def moving(world, limits):
        watches.append(world.object_count)
        still = np.zeros(world.object_count)
        return StillnessReport(False, 0.25, still + 0.01, still, ())

    monkeypatch.setattr(clutter, "watch_stillness", moving)
    count = len(scene.objects)
    end = again_at_rest(scene, (), ObjectRange(count - 1, count), WORKSPACE, CONFIG)
    assert end is Reason.NOT_AT_REST
    assert watches == [count] + [count - 1] * (CONFIG.idle_rounds + 1)
