"""The first look, for any target of a scene, is the look that the pipeline would take."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import UnknownNameError
from torc.generation.config import Hiddenness, hiddenness_of
from torc.generation.inspection import Difficulty, stated_difficulty, surroundings
from torc.objects.library import load_object
from torc.perception.segmentation import PerceptionConfig
from torc.problems.problem import ObjectPlacement, Problem, load_problem
from torc.records import TARGET_ID
from torc.workspace.workspace_files import load_workspace

SCENE = load_problem("structured-04")


@pytest.fixture(scope="module")
def view(inspector):
    return inspector.view(SCENE)


def test_another_target_is_the_same_picture_with_other_numbers(inspector, view):
    other = SCENE.objects[-1].name
    renumbered = view.capture_for(other)
    fresh = inspector.view(replace(SCENE, target=other))
    assert np.array_equal(renumbered.label_image, fresh.capture.label_image)
    assert np.array_equal(renumbered.observation.depth_m, fresh.capture.observation.depth_m)
    for placement in SCENE.objects:
        assert view.fraction(placement.name) == fresh.fraction(placement.name)
        assert view.pixels(placement.name) == fresh.pixels(placement.name)


def test_fractions_are_those_of_the_picture(view):
    labels = view.capture.label_image
    for i, placement in enumerate(SCENE.ordered()):
        assert view.pixels(placement.name) == np.count_nonzero(labels == i)
        assert 0.0 <= view.fraction(placement.name) <= 1.0


@pytest.mark.long
def test_graspable_at_first_is_what_the_pipeline_finds_among_all_objects(inspector, view):
    pipeline = replace(inspector.system.pipeline, min_score=0.0)
    answers = []
    for placement in SCENE.objects:
        look = pipeline.look(view.capture_for(placement.name))
        expected = look.context.report.has_valid_grasp(TARGET_ID)
        assert inspector.graspable_at_first(view, placement.name) == expected, placement.name
        answers.append(expected)
    assert len(set(answers)) == 2  # some can be grasped, some cannot


@pytest.mark.parametrize(
    ("fraction", "pixels", "group"),
    [
        (0.9, PerceptionConfig().min_target_pixels - 1, Hiddenness.HIDDEN),
        (0.1, PerceptionConfig().min_target_pixels, Hiddenness.PARTLY),
        (0.7499, 1000, Hiddenness.PARTLY),
        (0.75, 1000, Hiddenness.VISIBLE),
    ],
)
def test_groups_by_what_is_visible(fraction, pixels, group):
    assert hiddenness_of(fraction, pixels) is group


STATED = Difficulty(len(SCENE.objects), Hiddenness.PARTLY, 0.3125, 7, 8, 9)


def test_what_a_file_states_of_another_target_does_not_count():
    origin = {"target": SCENE.target, **STATED.facts()}
    assert stated_difficulty(replace(SCENE, origin=origin)) == STATED
    assert stated_difficulty(replace(SCENE, origin={**origin, "target": "another"})) is None


TABLE_Z = load_workspace().support_z_m
CAMERA = load_workspace().camera.T_world_camera


def _standing(name, model, x, y, above_m=0.0):
    z = TABLE_Z + above_m + load_object(model).size_m[2] / 2
    return ObjectPlacement(name, model, (x, y, z), (1.0, 0.0, 0.0, 0.0))


# 66 mm wide, 101 mm high, straight ahead of the camera
TARGET = _standing("target", "soup_can_red", 0.70, 0.0)


def _around(target, *others):
    return surroundings(Problem("p", "structured", "", "target", (*others, target)), "target", CAMERA)


@pytest.mark.parametrize(
    ("model", "x", "y", "groups"),
    [
        ("die_red", 0.55, 0.0, {"in_front"}),
        ("die_red", 0.55, -0.06, set()),  # the robot looks past it, and it is not level with the target
        ("die_red", 0.85, 0.0, set()),  # behind, and lower
        ("die_red", 0.70, 0.19, {"beside"}),  # 140 mm from side to side
        ("die_red", 0.70, 0.21, set()),  # 160 mm
        ("spray_can_red", 0.70, 0.10, {"beside", "taller"}),
        ("spray_can_red", 0.85, 0.0, {"taller"}),  # behind, 84 mm away
        ("spray_can_red", 0.94, 0.0, set()),  # behind, 174 mm away
        ("spray_can_red", 0.55, 0.0, {"in_front", "taller"}),
    ],
)
def test_an_object_is_where_it_stands(model, x, y, groups):
    found = _around(TARGET, _standing("other", model, x, y))
    named = {g for g in ("in_front", "beside", "taller") if "other" in getattr(found, g)}
    assert named == groups
    assert ("other" in found.all) == bool(groups)


def test_in_front_follows_the_line_of_sight_not_the_x_axis():
    # From the camera at (0.10, 0) the line to (0.70, -0.30) passes (0.50, -0.20).
    target = _standing("target", "soup_can_red", 0.70, -0.30)
    on_the_line = _standing("on", "die_red", 0.50, -0.20)
    straight = _standing("straight", "die_red", 0.50, -0.32)
    assert _around(target, on_the_line, straight).in_front == ("on",)


def test_an_unknown_target_is_an_error():
    with pytest.raises(UnknownNameError, match="target"):
        surroundings(Problem("p", "structured", "", "target", (TARGET,)), "tarqet", CAMERA)
