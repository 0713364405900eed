"""Imported scenes settle on the table; what does not work is reported."""

from dataclasses import replace

import numpy as np
import pytest
from settled_scenes import OBJECTS, QUICK, settled

from tests.helpers.graspclutter6d_tree import TreeObject, upright
from torc.generation.graspclutter6d.settling import SceneFailure, SettledScene
from torc.geometry.transforms import make_pose
from torc.sim.settling import SettleConfig
from torc.sim.stillness import StillnessConfig
from torc.workspace.description import Workspace


def _lifted(tree_object, dz):
    return TreeObject(tree_object.object_id, make_pose(p=(0, 0, dz)) @ tree_object.T_table_mesh)


def test_a_standing_scene_settles_where_it_was_annotated(tmp_path):
    scene = settled(tmp_path / "tree", OBJECTS)
    assert isinstance(scene, SettledScene)
    assert scene.fell == ()
    support = Workspace().support_z_m
    for placement in scene.problem.objects:
        before = scene.annotated[placement.name]
        assert np.abs(np.subtract(placement.position, before.position)[:2]).max() < 0.002
        assert -0.001 < before.position[2] - placement.position[2] - 0.005 < 0.002
        assert placement.position[2] > support
    assert any("settling moved objects sideways by 0 mm" in note for note in scene.notes)


def test_the_same_scene_settles_the_same_way(tmp_path):
    first = settled(tmp_path / "a", OBJECTS)
    second = settled(tmp_path / "b", OBJECTS)
    assert first.problem == second.problem


def test_objects_inside_each_other_are_eased_apart_and_told(tmp_path):
    crowded = (*OBJECTS[:2], upright(48, 0.10, 0.10), OBJECTS[2])  # two cans 16 mm inside each other
    scene = settled(tmp_path / "tree", crowded)
    assert isinstance(scene, SettledScene)
    assert any("inside each other" in note for note in scene.notes)
    assert len(scene.problem.objects) == 4


def test_objects_in_one_place_break_nothing(tmp_path):
    result = settled(tmp_path / "tree", (*OBJECTS, upright(17, 0.0, 0.0, 0.3)))
    if isinstance(result, SceneFailure):
        assert "could not be settled" in result.reason


def test_what_falls_off_is_left_out_and_named(tmp_path):
    beyond = (upright(48, 0.0, 0.80), upright(48, 0.0, -0.80))  # still falling when the others are at rest
    scene = settled(tmp_path / "tree", (*OBJECTS, *beyond), config=replace(QUICK, patience=1))
    assert scene.fell == ("obj_000048_0", "obj_000048_1")
    assert {o.name for o in scene.problem.objects}.isdisjoint(scene.fell)
    assert any("fell off" in note and "obj_000048_1" in note for note in scene.notes)


@pytest.mark.parametrize(
    ("scene", "told"),
    [
        (
            (upright(17, 0.0, 0.0),),
            "it has one object only, so nothing stands around a target: choose another",
        ),
        ((upright(17, 0.0, -1.8), upright(17, 0.0, 0.0), upright(48, 0.0, 1.8)), "2 of 3 objects fell off"),
        ((upright(17, 0.0, -0.9), upright(48, 0.0, 0.9)), "2 of 2 objects fell off"),
    ],
)
def test_one_object_alone_is_no_problem_and_it_says_why(tmp_path, scene, told):
    failure = settled(tmp_path / "tree", scene)
    assert isinstance(failure, SceneFailure)
    assert told in failure.reason
    assert "nothing stands around a target: choose another scene" in failure.reason


def test_a_scene_that_does_not_come_to_rest_is_reported(tmp_path):
    high = [*OBJECTS[:3], _lifted(OBJECTS[3], 0.3)]
    hasty = replace(QUICK, settle=SettleConfig(limit_s=0.15))
    failure = settled(tmp_path / "tree", high, config=hasty)
    assert isinstance(failure, SceneFailure)
    assert "not at rest after 0 s" in failure.reason


def test_a_scene_that_creeps_is_reported(tmp_path):
    picky = replace(QUICK, still=StillnessConfig(distance_m=0.0, seconds=0.3), patience=1)
    failure = settled(tmp_path / "tree", OBJECTS, config=picky)
    assert isinstance(failure, SceneFailure)
    assert "never still" in failure.reason


def test_the_scene_that_is_there_twice_says_so(tmp_path):
    scene = settled(tmp_path / "tree", OBJECTS, scene=404)
    assert any("twice, as 404 and as 401" in note for note in scene.notes)
