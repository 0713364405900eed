"""Depth and colours of one camera at another one's pixels: against ray casting, and against librealsense."""

import cv2
import numpy as np
import pytest
from camera_scenes import COLOR, DEPTH, POSE, T_COLOR_DEPTH, realsense, seen

from lab_helpers.realsense_feeder import Lens
from torc.geometry.transforms import invert, make_pose, rotation_about
from torc_lab.cameras.registration import registered_colors, registered_depth

FINE, COARSE = Lens(640, 480, 480.0), Lens(160, 120, 110.0)


def flat(depth_m):
    """Pixels away from edges, near enough to be the table."""
    steps = cv2.dilate(depth_m, np.ones((7, 7))) - cv2.erode(depth_m, np.ones((7, 7)))
    return (steps < 0.05) & (depth_m < 1.2)


@pytest.mark.parametrize("roll_deg", [0, 90, 180])
@pytest.mark.parametrize("lens", [COLOR, FINE, COARSE])
def test_depth_is_what_the_other_camera_would_measure(lens, roll_deg):
    """Without a bias, whichever way the table slants, and without holes, also where the other picture is finer."""
    pose = POSE @ make_pose(rotation_about([0, 0, 1], np.deg2rad(roll_deg)))
    truth = seen(lens, pose @ invert(T_COLOR_DEPTH)).depth_m
    found = registered_depth(seen(DEPTH, pose).depth_m, DEPTH.K, T_COLOR_DEPTH, lens.K, truth.shape)
    table = flat(truth)
    read = table & (found > 0)
    error = (found - truth)[read]
    assert abs(np.median(error)) < 0.0002
    assert np.percentile(np.abs(error), 99) < 0.0045
    closed = cv2.morphologyEx((found > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3))) > 0
    assert (found[closed & table] == 0).mean() < 0.0005


def test_a_camera_at_the_same_place_changes_nothing():
    depth = seen(DEPTH, POSE).depth_m
    depth[50:60, 50:60] = 0
    np.testing.assert_allclose(
        registered_depth(depth, DEPTH.K, np.eye(4), DEPTH.K, depth.shape), depth, rtol=1e-6
    )


def test_what_is_in_front_hides_what_is_behind():
    """A near square before a far wall, seen from the right, wherever it stands in the picture."""
    K = np.array([[100.0, 0, 50], [0, 100, 40], [0, 0, 1]])
    for left in (10, 40, 60):
        depth = np.full((80, 100), 2.0, np.float32)
        depth[30:50, left : left + 20] = 0.5
        found = registered_depth(depth, K, make_pose(None, [-0.05, 0, 0]), K, depth.shape)
        # .05 m make 10 pixels at .5 m, and 2.5 at 2 m.
        square = found[30:50] == 0.5
        assert square.any(axis=0).sum() == min(20, left + 10)
        columns = np.flatnonzero(square.all(axis=0))
        assert columns[-1] == left + 9
        assert (found[30:50, left + 11 : left + 17] == 0).all()  # neither camera knows what is there
        assert (found[:28, :95] == 2.0).all()


def test_it_agrees_with_librealsense_where_that_is_right():
    """Parallel cameras, no distortion: up to the pixel that rs.align prefers."""
    rs = pytest.importorskip("pyrealsense2", reason="pyrealsense2 is not installed", exc_type=ImportError)
    T = make_pose(None, [0.015, 0.002, 0.0])
    device = realsense(T_color_depth=T)
    frames = device(None).wait()
    theirs = np.asanyarray(rs.align(rs.stream.color).process(frames).get_depth_frame().get_data()) * 0.001
    device.close()
    depth = np.asanyarray(frames.get_depth_frame().get_data()) * np.float32(0.001)
    mine = registered_depth(depth, DEPTH.K, T, COLOR.K, theirs.shape)
    both = (mine > 0) & (theirs > 0) & flat(mine)
    assert both.mean() > 0.3
    assert np.percentile(np.abs(mine - theirs)[both], 99) < 0.009
    assert ((mine > 0) != (theirs > 0))[flat(mine)].mean() < 0.02


def test_colours_lie_on_the_depth_that_they_belong_to():
    depth = seen(DEPTH, POSE)
    color = seen(COLOR, POSE @ invert(T_COLOR_DEPTH))
    holes = depth.depth_m.copy()
    holes[100:110, 100:110] = 0
    found = registered_colors(color.rgb, COLOR.K, holes, DEPTH.K, T_COLOR_DEPTH)
    assert (found[100:110, 100:110] == 0).all()
    known = (found.sum(axis=2) > 0) & flat(depth.depth_m)
    assert known.mean() > 0.4
    assert np.percentile(np.abs(found.astype(int) - depth.rgb)[known], 99) <= 8


def test_nothing_is_seen_of_nothing():
    none = np.zeros((240, 320), np.float32)
    assert not registered_depth(none, DEPTH.K, T_COLOR_DEPTH, COLOR.K, (240, 320)).any()
    # All of it is behind the other camera.
    turned = make_pose(rotation_about([0, 1, 0], np.pi))
    assert not registered_depth(none + 1, DEPTH.K, turned, COLOR.K, (240, 320)).any()
    rgb = np.full((240, 320, 3), 200, np.uint8)
    assert not registered_colors(rgb, COLOR.K, none + 1, DEPTH.K, turned).any()
