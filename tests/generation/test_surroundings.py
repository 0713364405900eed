"""Who is in front, beside, taller: scenes in which that is known."""

import pytest

from torc.errors import UnknownNameError
from torc.generation.inspection import surroundings
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem
from torc.workspace.files import load_workspace

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
