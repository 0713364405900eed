"""Imported scenes settle on the table, what does not work is reported, and targets and labels follow the rules."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.generation.imports import (
    ImportConfig,
    SceneFailure,
    SettledScene,
    category_of,
    choose_target,
    find_target,
    make_problem,
    settle_scene,
)
from torc.generation.surroundings import Surroundings
from torc.geometry.transforms import make_pose, rotation_about
from torc.scenes.importing.graspclutter6d import objects
from torc.scenes.importing.graspclutter6d.annotations import read_scene
from torc.scenes.problem import parse_problem, problem_text
from torc.scenes.workspace import Workspace
from torc.sim.settling import SettleConfig
from torc.sim.stillness import StillnessConfig
from torc.testing.graspclutter6d_tree import TreeObject, upright, write_tree
from torc.testing.plain_mesh_reader import read_plain_mesh

OBJECTS = (
    upright(17, 0.0, 0.0, 0.3),
    upright(44, 0.10, 0.05),
    upright(56, -0.10, 0.02, 1.0),
    upright(44, 0.1, -0.06),
)
QUICK = ImportConfig(still=StillnessConfig(seconds=1.0))


@pytest.fixture(autouse=True)
def _instant_meshes(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "store"))
    monkeypatch.setattr(objects, "read_mesh", read_plain_mesh)


def _settle(root, scene_objects, scene=249, config=QUICK, **tree):
    write_tree(root, {scene: scene_objects}, images=16, **tree)
    return settle_scene(root, read_scene(root, scene), config)


def _lifted(tree_object, dz):
    return TreeObject(tree_object.object_id, make_pose(p=(0, 0, dz)) @ tree_object.T_table_mesh)


def test_a_standing_scene_settles_where_it_was_annotated(tmp_path):
    scene = _settle(tmp_path / "tree", OBJECTS)
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
    first = _settle(tmp_path / "a", OBJECTS)
    second = _settle(tmp_path / "b", OBJECTS)
    assert first.problem == second.problem


def test_objects_inside_each_other_are_eased_apart_and_told(tmp_path):
    crowded = (*OBJECTS[:2], upright(48, 0.10, 0.10), OBJECTS[2])  # two cans 16 mm inside each other
    scene = _settle(tmp_path / "tree", crowded)
    assert isinstance(scene, SettledScene)
    assert any("inside each other" in note for note in scene.notes)
    assert len(scene.problem.objects) == 4


def test_objects_in_one_place_break_nothing(tmp_path):
    result = _settle(tmp_path / "tree", (*OBJECTS, upright(17, 0.0, 0.0, 0.3)))
    if isinstance(result, SceneFailure):
        assert "could not be settled" in result.reason


def test_what_falls_off_is_left_out_and_named(tmp_path):
    beyond = (upright(48, 0.0, 0.80), upright(48, 0.0, -0.80))  # still falling when the others are at rest
    scene = _settle(tmp_path / "tree", (*OBJECTS, *beyond), config=replace(QUICK, patience=1))
    assert scene.fell == ("obj_000048_0", "obj_000048_1")
    assert {o.name for o in scene.problem.objects}.isdisjoint(scene.fell)
    assert any("fell off" in note and "obj_000048_1" in note for note in scene.notes)
    failure = find_target(scene, "48_0")
    assert isinstance(failure, SceneFailure)
    assert "fell off" in failure.reason


def test_a_scene_that_does_not_come_to_rest_is_reported(tmp_path):
    high = [*OBJECTS[:3], _lifted(OBJECTS[3], 0.3)]
    hasty = replace(QUICK, settle=SettleConfig(limit_s=0.15))
    failure = _settle(tmp_path / "tree", high, config=hasty)
    assert isinstance(failure, SceneFailure)
    assert "not at rest after 0 s" in failure.reason


def test_a_scene_that_creeps_is_reported(tmp_path):
    picky = replace(QUICK, still=StillnessConfig(distance_m=0.0, seconds=0.3), patience=1)
    failure = _settle(tmp_path / "tree", OBJECTS, config=picky)
    assert isinstance(failure, SceneFailure)
    assert "never still" in failure.reason


def test_the_scene_that_is_there_twice_says_so(tmp_path):
    scene = _settle(tmp_path / "tree", OBJECTS, scene=404)
    assert any("twice, as 404 and as 401" in note for note in scene.notes)


def test_targets_are_named_by_object_and_instance(tmp_path):
    scene = _settle(tmp_path / "tree", OBJECTS)
    assert find_target(scene, "17") == find_target(scene, "17_0") == "obj_000017_0"
    assert find_target(scene, "obj_000044_1") == "obj_000044_1"
    with pytest.raises(InputError, match=r"44 2 times: say which: obj_000044_0, obj_000044_1"):
        find_target(scene, "44")
    with pytest.raises(InputError, match=r"has no object 44_2\. It has: obj_000017_0"):
        find_target(scene, "44_2")


def test_a_problem_says_where_it_comes_from_and_survives_the_disk(tmp_path):
    scene = _settle(tmp_path / "tree", OBJECTS)
    problem = make_problem(scene, "obj_000044_1", 0.254, QUICK, facts={"paper_problem": True})
    assert problem.name == "gc6d-249-obj_000044_1"
    assert problem.category == "structured"
    assert problem.description == "the can of peaches"
    assert problem.target == "obj_000044_1"
    assert "25% of the target is in sight" in problem.notes
    assert "2 objects like the target" in problem.notes
    assert problem.origin["scene"] == 249
    assert problem.origin["placement"] == "torc"
    assert "CC-BY-SA" in problem.origin["licence"]
    assert problem.origin["paper_problem"] is True
    assert parse_problem(problem_text(problem)) == problem


def test_the_label_is_the_users_else_the_published_one_else_computed(tmp_path):
    scene = _settle(tmp_path / "tree", OBJECTS)
    assert category_of(scene) == ("structured", "the authors' label")
    assert category_of(replace(scene, scene=30))[0] == "unstructured"
    unknown = replace(scene, scene=5000)
    assert category_of(unknown) == ("structured", "most objects' resting pose")
    leaning = [
        replace(scene.annotated[n], wxyz=(np.cos(0.2), np.sin(0.2), 0.0, 0.0))
        for n in list(scene.annotated)[:2]
    ]
    half = replace(unknown, annotated=scene.annotated | {o.name: o for o in leaning})
    assert category_of(half)[0] == "unstructured"
    by_user = make_problem(scene, "obj_000017_0", 1.0, QUICK, "unstructured")
    assert (by_user.category, by_user.origin["category_by"]) == ("unstructured", "the user")


def test_lying_on_a_side_is_a_natural_pose_too(tmp_path):
    lying = [
        TreeObject(o.object_id, make_pose(rotation_about((1, 0, 0), np.pi / 2)) @ o.T_table_mesh)
        for o in OBJECTS[:1]
    ]
    scene = _settle(tmp_path / "tree", (*lying, upright(44, 0.2, 0.1), upright(44, 0.2, -0.1)), scene=2000)
    assert category_of(scene)[0] == "structured"


class _Inspector:
    """Says what it is told to."""

    def __init__(self, impossible=(), at_once=(), around=None):
        self.impossible, self.at_once, self.neighbours = impossible, at_once, around or {}

    def graspable_at_all(self, problem, name):
        return name not in self.impossible

    def graspable_at_first(self, view, target):
        return target in self.at_once

    def around(self, problem, target):
        return Surroundings(tuple(self.neighbours.get(target, ())), (), ())


class _View:
    def __init__(self, **fractions):
        self.fractions = fractions

    def fraction(self, name):
        return self.fractions[name]


def test_the_least_visible_possible_object_is_chosen(tmp_path):
    scene = _settle(tmp_path / "tree", OBJECTS)
    names = [o.name for o in scene.problem.objects]
    view = _View(**dict(zip(names, (0.1, 0.2, 0.3, 0.4))))
    assert choose_target(scene, view, _Inspector()) == names[0]
    assert choose_target(scene, view, _Inspector(impossible=names[:1])) == names[1]
    assert choose_target(scene, view, _Inspector(at_once=names[:2])) == names[2]
    blocked = _Inspector(impossible=[names[3]], around={names[0]: [names[3]], names[1]: [names[2]]})
    assert choose_target(scene, view, blocked) == names[1]
    none = choose_target(scene, view, _Inspector(impossible=names[:3], at_once=names[3:]))
    assert isinstance(none, SceneFailure)
    assert "3 cannot be retrieved, 1 can be picked at once" in none.reason
