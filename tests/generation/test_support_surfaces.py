"""Surface clouds lie on the surface, all around, with outward normals, the same every time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from torc.generation.surfaces import SPACING_M, placed, surface_cloud
from torc.geometry.transforms import make_pose, rotation_about
from torc.objects.library import load_object

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
