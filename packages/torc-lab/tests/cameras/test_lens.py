"""Lenses: as OpenCV and librealsense have them."""

import cv2
import numpy as np
import pytest

from torc_lab.cameras.lens import distorted, pinhole_map

K = np.array([[300.0, 0, 160], [0, 310, 118], [0, 0, 1]])
PLUMB_BOB = (-0.28, 0.09, 0.003, -0.002, -0.01)
RATIONAL = (0.4, -0.1, 0.001, 0.002, 0.03, 0.7, -0.02, 0.01)


@pytest.mark.parametrize("coefficients", [PLUMB_BOB, PLUMB_BOB[:4], RATIONAL])
def test_points_are_moved_as_opencv_moves_them(rng, coefficients):
    rays = np.c_[rng.uniform(-0.5, 0.5, (50, 2)), np.ones(50)]
    expected = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), np.array(coefficients))[0]
    x, y = distorted(rays[:, 0], rays[:, 1], np.array(coefficients))
    np.testing.assert_allclose(np.stack([x, y], axis=-1), expected.reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("model", ["brown_conrady", "modified_brown_conrady", "inverse_brown_conrady"])
def test_points_are_moved_as_librealsense_moves_them(rng, model):
    rs = pytest.importorskip("pyrealsense2", reason="pyrealsense2 is not installed", exc_type=ImportError)
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height, intrinsics.fx, intrinsics.fy = 640, 480, 1.0, 1.0
    intrinsics.ppx = intrinsics.ppy = 0.0
    intrinsics.model, intrinsics.coeffs = getattr(rs.distortion, model), list(PLUMB_BOB)
    rays = rng.uniform(-0.5, 0.5, (20, 2))
    expected = [rs.rs2_project_point_to_pixel(intrinsics, [x, y, 1.0]) for x, y in rays]
    found = distorted(rays[:, 0], rays[:, 1], np.array(PLUMB_BOB), modified=model != "brown_conrady")
    np.testing.assert_allclose(np.stack(found, axis=-1), expected, atol=1e-6)


def test_the_map_is_opencvs(rng):
    found = pinhole_map(K, (240, 320), np.array(PLUMB_BOB))
    expected = cv2.initUndistortRectifyMap(K, np.array(PLUMB_BOB), None, K, (320, 240), cv2.CV_32FC1)
    np.testing.assert_allclose(found.cols, expected[0], atol=1e-3)
    np.testing.assert_allclose(found.rows, expected[1], atol=1e-3)


def test_no_distortion_needs_no_map():
    assert pinhole_map(K, (240, 320), np.zeros(5)) is None
    assert pinhole_map(K, (240, 320), np.array([1e-5, 0, 0, 0, 0])) is None


def test_depth_is_never_mixed_of_two_surfaces():
    found = pinhole_map(K, (240, 320), np.array(PLUMB_BOB))
    depth = np.where(np.arange(320) < 100, 0.5, 2.0).astype(np.float32)[None].repeat(240, axis=0)
    assert set(np.unique(found.depth(depth))) <= {0.0, 0.5, 2.0}
