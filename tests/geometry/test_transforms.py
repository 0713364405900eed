"""Laws of rigid transforms and of the pinhole camera."""

import numpy as np
import pytest

from torc.geometry.transforms import (
    intrinsics,
    invert,
    kernel_array,
    look_at,
    make_pose,
    project,
    rotation_about,
    rotation_from_wxyz,
    transform_points,
    unproject,
    wxyz_from_rotation,
)


def _poses(rng, n):
    return np.stack([make_pose(rotation_from_wxyz(rng.normal(size=4)), rng.normal(size=3)) for _ in range(n)])


def test_inverse_undoes(rng):
    T = _poses(rng, 50)
    assert np.allclose(invert(T) @ T, np.eye(4))


def test_quaternions_round_trip_near_every_branch(rng):
    for axis in np.vstack([np.eye(3), rng.normal(size=(20, 3))]):
        for angle in (0.0, 1e-9, 0.5, np.pi - 1e-7, np.pi, -2.0):
            R = rotation_about(axis, angle)
            assert np.allclose(rotation_from_wxyz(wxyz_from_rotation(R)), R, atol=1e-7)


def test_zero_quaternion_is_refused():
    with pytest.raises(ValueError, match="zero"):
        rotation_from_wxyz([0, 0, 0, 0])


def test_projection_undoes_unprojection(rng):
    K, T = intrinsics(640, 480, 1.4), look_at((0.1, 0, 1.4), (0.6, -0.1, 1.1))
    cols, rows, depth = rng.uniform(0, 639, 100), rng.uniform(0, 479, 100), rng.uniform(0.2, 2, 100)
    c, r, d = project(unproject(rows, cols, depth, K, T), K, T)
    assert np.allclose(c, cols)
    assert np.allclose(r, rows)
    assert np.allclose(d, depth)


def test_camera_looks_where_it_should_with_the_image_upright():
    T = look_at((0.1, 0, 1.4), (0.6, -0.1, 1.1))
    ahead = transform_points(invert(T), np.array([[0.6, -0.1, 1.1], [0.6, -0.1, 1.2]]))
    assert np.allclose(ahead[0, :2], 0)
    assert ahead[1, 1] < 0  # what is higher in the world is higher in the image
    assert np.isclose(np.linalg.det(T[:3, :3]), 1)


def test_an_array_that_is_right_is_not_copied():
    array = np.arange(6.0).reshape(2, 3)
    assert kernel_array(array) is array
    labels = np.zeros((3, 4), dtype=np.int16)
    assert kernel_array(labels, np.int16) is labels


@pytest.mark.parametrize(
    "array",
    [
        np.asfortranarray(np.arange(12).reshape(3, 4)),
        np.arange(24).reshape(4, 6)[::2, ::3],
        np.broadcast_to(np.arange(3.0), (1, 3)),
        np.broadcast_to(np.arange(3.0), (5, 3)),
        np.frombuffer(np.arange(4.0).tobytes()),
        np.arange(3, dtype=">f8"),
        [[1, 2], [3, 4]],
        np.zeros((0, 3), dtype=np.float32),
    ],
)
def test_all_others_become_plain(array):
    out = kernel_array(array)
    np.testing.assert_array_equal(out, array)
    assert out.dtype == np.float64
    assert out.dtype.isnative
    assert out.flags.c_contiguous
    assert out.flags.writeable
    assert out.flags.aligned
