"""Laws of the analytic scenes."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.geometry.transforms import rotation_about, unproject, wxyz_from_rotation
from torc.records import BACKGROUND
from torc.testing.synthetic import (
    SyntheticBox,
    SyntheticCylinder,
    SyntheticSphere,
    half_sizes,
    inside,
    random_clutter,
    raycast,
    shape_pose,
    synthetic_observation,
)
from torc.workspace.workspace_files import load_workspace

TILT = tuple(wxyz_from_rotation(rotation_about((1, 2, 3), 0.7)))
SHAPES = (
    SyntheticBox(0, (0.6, 0.0, 1.15), (0.08, 0.05, 0.12), TILT),
    SyntheticCylinder(3, (0.6, 0.2, 1.15), 0.04, 0.12, TILT),
    SyntheticCylinder(4, (0.75, 0.0, 1.1), 0.04, 0.1),
    SyntheticSphere(7, (0.6, -0.2, 1.15), 0.05),
)


def _pixel_points(image, mount):
    rows, cols = np.indices(image.depth_m.shape)
    return unproject(
        rows.ravel(), cols.ravel(), image.depth_m.astype(float).ravel(), mount.K, mount.T_world_camera
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_hits_lie_on_the_surface(shape):
    mount = load_workspace().camera
    image = raycast([shape], mount)
    points = _pixel_points(image, mount)[image.label_image.ravel() == shape.id]
    assert len(points) > 200
    assert np.all(inside(shape, points, 1e-5))
    assert not np.any(inside(shape, points, -1e-5))


@pytest.mark.parametrize("shape", SHAPES)
def test_normals_point_out_of_the_shape_and_at_the_camera(shape):
    mount = load_workspace().camera
    image = raycast([shape], mount)
    mask = image.label_image == shape.id
    points, normals = _pixel_points(image, mount)[mask.ravel()], image.normals[mask].astype(float)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    assert not np.any(inside(shape, points + 1e-4 * normals))
    assert np.all(np.sum(normals * (mount.T_world_camera[:3, 3] - points), axis=1) > 0)


def test_table_lies_at_its_height_and_the_room_closes_every_ray():
    mount = load_workspace().camera
    image = raycast([], mount, support_z_m=0.9)
    points = _pixel_points(image, mount)
    assert np.all(image.depth_m > 0)
    assert np.all(image.label_image == BACKGROUND)
    on_table = (np.abs(points[:, 0] - 0.7) < 0.2) & (np.abs(points[:, 1]) < 0.3) & (points[:, 2] > 0.5)
    assert on_table.sum() > 1000
    assert np.allclose(points[on_table, 2], 0.9, atol=1e-5)


@pytest.mark.parametrize("n", [0, 1, 15, 40])
def test_clutter_is_disjoint_and_stands_on_something(n):
    shapes = random_clutter(np.random.default_rng(n), n)
    assert [s.id for s in shapes] == list(range(n))
    tops = {load_workspace().support_z_m, *(s.center[2] + half_sizes(s)[2] for s in shapes)}
    rng = np.random.default_rng(0)
    for s in shapes:
        assert min(abs(s.center[2] - half_sizes(s)[2] - top) for top in tops) < 1e-9
        T = shape_pose(s)
        points = rng.uniform(-1, 1, (300, 3)) * half_sizes(s) @ T[:3, :3].T + T[:3, 3]
        points = points[inside(s, points)]
        assert not any(np.any(inside(o, points, -1e-6)) for o in shapes if o is not s)


def test_a_shape_without_volume_is_refused():
    with pytest.raises(InputError, match="volume"):
        synthetic_observation([SyntheticBox(0, (0.6, 0, 1.1), (0.1, 0.0, 0.1))])
