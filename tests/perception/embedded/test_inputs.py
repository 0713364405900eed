"""The network's inputs: geometry against brute force, and the laws that let one network serve all cameras."""

from dataclasses import replace

import numpy as np
import pytest

from torc.geometry.transforms import intrinsics, look_at, make_pose, rotation_about, unproject
from torc.perception.embedded.inputs import CHANNELS, View, Window, channels, cut, filled, heading
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_observation
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

SHAPES = (box(1, 0.62, -0.10, (0.05, 0.06, 0.10)), box(2, 0.70, -0.2, (0.08, 0.05, 0.05)))
SUPPORT_Z_M = load_workspace().support_z_m


def view_of(mount=None):
    o = synthetic_observation(SHAPES, mount)
    return View(o.rgb, o.depth_m, o.K, o.T_world_camera, SUPPORT_Z_M)


def test_points_are_those_of_the_pixels_in_the_headings_frame():
    view = view_of()
    window = Window(200, 300, 1.0)
    patch = cut(view, window, 64, 96)
    rows, cols = np.mgrid[200:264, 300:396]
    world = unproject(rows, cols, view.depth_m[rows, cols].astype(float), view.K, view.T_world_camera)
    expected = (world - [0, 0, SUPPORT_Z_M]) @ heading(view.T_world_camera).T
    np.testing.assert_allclose(patch.points, expected, atol=1e-5)
    assert np.array_equal(patch.rgb, view.rgb[200:264, 300:396])


def test_the_heading_is_level_and_right_handed():
    for eye in ([0.1, 0.0, 1.4], [0.6, -0.1, 2.0], [1.0, 0.5, 1.2]):
        R = heading(look_at(eye, [0.65, -0.12, 1.05]))
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(R[2], [0, 0, 1])
        assert np.linalg.det(R) == pytest.approx(1)


def test_a_camera_that_looks_straight_down_has_a_heading():
    down = make_pose(np.diag([1.0, -1.0, -1.0]), [0, 0, 2])
    np.testing.assert_allclose(heading(down)[1], [0, 1, 0], atol=1e-12)


def test_inputs_do_not_change_when_the_world_turns_about_the_vertical():
    view = view_of()
    turn = make_pose(rotation_about((0, 0, 1), 1.0), [0.3, -2.0, 0.0])
    turned = replace(view, T_world_camera=turn @ view.T_world_camera)
    a, b = (channels(cut(v, Window(200, 300, 0.8), 64, 96)) for v in (view, turned))
    np.testing.assert_allclose(a, b, atol=2e-3)


def test_a_finer_picture_of_the_same_view_gives_nearly_the_same_inputs():
    own = load_workspace().camera
    fine = CameraMount(own.T_world_camera, 2 * own.width, 2 * own.height, own.vertical_fov_rad)
    coarse = channels(cut(view_of(), Window(200, 300, 1.0), 64, 96))
    finer = channels(cut(view_of(fine), Window(400, 600, 0.5), 64, 96))
    close = np.abs(coarse[:5] - finer[:5]).max(axis=0) < 0.2
    assert close.mean() > 0.88  # all but the outlines


def test_channels_tell_height_normals_and_readings():
    view = view_of()
    depth = view.depth_m.copy()
    depth[210:214, 310:330] = 0
    patch = cut(replace(view, depth_m=depth), Window(200, 300, 1.0), 96, 128)
    out = channels(patch)
    assert out.shape == (CHANNELS, 96, 128)
    assert out.dtype == np.float32
    assert np.isfinite(out).all()
    assert (out[5] == (patch.depth_m > 0)).all()
    np.testing.assert_allclose(np.linalg.norm(out[2:5, 1:-1, 1:-1], axis=0), 1, atol=1e-4)
    table = (np.abs(patch.points[..., 2]) < 1e-4) & (np.roll(patch.points[..., 2], 4, 0) < 1e-4)
    assert np.median(out[4][table]) > 0.99  # up


def test_filling_keeps_readings_and_makes_up_the_rest_from_around():
    depth = np.full((40, 50), 2.0, np.float32)
    depth[:, 25:] = 3.0
    depth[10:20, 5:15] = 0
    out = filled(depth)
    assert (out[depth > 0] == depth[depth > 0]).all()
    np.testing.assert_allclose(out[10:20, 5:15], 2.0, atol=0.01)
    assert (filled(np.zeros((16, 16), np.float32)) == 0).all()


def test_outside_of_the_picture_there_is_no_reading():
    patch = cut(view_of(), Window(-40, -30, 1.0), 64, 64)
    assert not patch.read[:40].any()
    assert not patch.read[:, :30].any()
    assert (patch.rgb[:39, :29] == 0).all()


def test_windows_map_pixel_centres():
    rows, cols = Window(10, 20, 2.0).source(4, 2)
    np.testing.assert_allclose(rows, [9.75, 10.25, 10.75, 11.25])
    np.testing.assert_allclose(cols, [19.75, 20.25])


def test_intrinsics_of_a_cut_fit_the_cut():
    """A patch of a part of a picture, with its intrinsics moved, is a patch of the picture."""
    view = view_of()
    K = view.K.copy()
    K[0, 2] -= 250
    K[1, 2] -= 180
    part = View(view.rgb[180:, 250:], view.depth_m[180:, 250:], K, view.T_world_camera, SUPPORT_Z_M)
    a = cut(view, Window(200, 300, 0.7), 64, 64)
    b = cut(part, Window(20, 50, 0.7), 64, 64)
    np.testing.assert_allclose(a.points, b.points, atol=1e-5)
    assert intrinsics(640, 480, 1.0)[2, 2] == 1
