"""Graspable at all: what a two-finger gripper of 85 mm can and cannot do, on full models."""

import numpy as np
import pytest

from torc.geometry.transforms import make_pose, rotation_about
from torc.objects.library import load_object
from torc.workspace.files import load_workspace

TABLE_Z = load_workspace().support_z_m


def _upright(model, x=0.65, y=-0.12):
    return make_pose(None, (x, y, TABLE_Z + load_object(model).size_m[2] / 2))


def _on_its_back(model, x=0.65, y=-0.12):
    return make_pose(rotation_about((0, 1, 0), np.pi / 2), (x, y, TABLE_Z + load_object(model).size_m[0] / 2))


@pytest.mark.parametrize(
    "model", ["soup_can_red", "mug_red", "bowl_blue", "marker_blue", "cereal_box_yellow"]
)
def test_household_things_that_stand_can_be_grasped(inspector, model):
    assert inspector.grasping.graspable(model, _upright(model))


@pytest.mark.parametrize("model", ["cereal_box_yellow", "cracker_box_red", "sugar_box_white"])
def test_large_boxes_that_lie_flat_cannot(inspector, model):
    assert not inspector.grasping.graspable(model, _on_its_back(model))


@pytest.mark.parametrize(("x", "y"), [(1.25, -0.12), (0.65, 0.60)])
def test_what_is_out_of_reach_cannot(inspector, x, y):
    assert not inspector.grasping.graspable("soup_can_red", _upright("soup_can_red", x, y))
