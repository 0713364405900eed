"""Graspable at all: what a two-finger gripper of 85 mm can do, on clouds of whole surfaces with outward normals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from torc.generation.grasps import SPACING_M, placed, surface_cloud
from torc.geometry.transforms import make_pose, rotation_about
from torc.objects.library import load_object
from torc.workspace.workspace_files import load_workspace

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


SOLID = ("soup_can_red", "cracker_box_red", "apple_red", "die_red")


def _inside(model, points):
    return np.any([piece.contains(points) for piece in model.pieces], axis=0)


@pytest.mark.parametrize("name", [*SOLID, "mug_red", "hammer_blue"])
def test_points_lie_on_the_surface_and_normals_point_out(name):
    model = load_object(name)
    points, normals = surface_cloud(model)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert not _inside(model, points + 0.003 * normals).any()
    assert _inside(model, points - 0.003 * normals).mean() > 0.95


@pytest.mark.parametrize("name", SOLID)
def test_points_are_all_around_and_evenly_spaced(name):
    model = load_object(name)
    points, _ = surface_cloud(model)
    half = np.array(model.size_m) / 2
    assert np.allclose(points.max(axis=0), half, atol=0.004)
    assert np.allclose(points.min(axis=0), -half, atol=0.004)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    assert np.percentile(nearest, 99) < 2 * SPACING_M


def test_the_same_every_time_and_moved_as_a_body():
    model = load_object("toy_car_blue")
    points, normals = surface_cloud(model)
    again, _ = surface_cloud(replace(model))
    assert again is not points
    assert np.array_equal(points, again)
    T = make_pose(rotation_about((1, 2, 3), 0.7), (0.1, -0.2, 0.3))
    moved, turned = placed(points, normals, T)
    assert np.allclose((moved - T[:3, 3]) @ T[:3, :3], points)
    assert np.allclose(turned @ T[:3, :3], normals)
