"""A camera's pose from its picture: the support is level at z = 0, whatever the camera's height, tilt and roll."""

from dataclasses import replace

import numpy as np
import pytest
from frame_makers import SHAPES, observe

from torc.errors import InputError
from torc.geometry.transforms import look_at, make_pose, rotation_about, transform_points, unproject
from torc.pipeline.frames.level import level_pose
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import CameraMount

SUPPORT_Z_M = 1.05


def seen_from(down_deg: float, roll_deg: float):
    """The boxes from .7 m away, so far below the horizon, turned about the optical axis."""
    down = np.deg2rad(down_deg)
    eye = (0.65 - 0.7 * np.cos(down), -0.1, SUPPORT_Z_M + 0.7 * np.sin(down))
    pose = look_at(eye, (0.65, -0.1, SUPPORT_Z_M)) @ make_pose(
        rotation_about([0, 0, 1], np.deg2rad(roll_deg))
    )
    return synthetic_capture(SHAPES, CameraMount(pose, 320, 240, 0.8))


@pytest.mark.parametrize("roll_deg", [0, 20, 90, 180])
@pytest.mark.parametrize("down_deg", [35, 45, 60, 88])
def test_it_is_the_pose_up_to_where_the_world_begins(down_deg, roll_deg):
    """180 degrees of roll is a camera that hangs upside down."""
    seen = seen_from(down_deg, roll_deg)
    o = seen.observation
    found = level_pose(o)
    # From the true world to the estimated one: a turn about z, and a shift.
    T = found @ np.linalg.inv(o.T_world_camera)
    np.testing.assert_allclose(T[2, :3], [0, 0, 1], atol=0.004)
    assert np.linalg.det(found[:3, :3]) == pytest.approx(1)
    labelled = seen.label_image >= 0
    rows, cols = np.nonzero(labelled)
    depth = o.depth_m[labelled].astype(float)
    true = unproject(rows, cols, depth, o.K, o.T_world_camera)
    mine = unproject(rows, cols, depth, o.K, found)
    np.testing.assert_allclose(mine[:, 2], true[:, 2] - SUPPORT_Z_M, atol=0.003)
    np.testing.assert_allclose(transform_points(T, true), mine, atol=1e-6)
    assert found[:3, 3] == pytest.approx([0, 0, 0.7 * np.sin(np.deg2rad(down_deg))], abs=0.004)


@pytest.mark.parametrize("roll_deg", [0, 90, 180])
def test_x_is_where_the_camera_looks(roll_deg):
    view = level_pose(seen_from(45, roll_deg).observation)[:3, 2]
    assert view[0] > 0.7
    assert view[1] == pytest.approx(0, abs=1e-6)


def test_noise_and_holes_move_it_by_millimetres(rng):
    o = seen_from(45, 0).observation
    depth = (o.depth_m + rng.normal(0, 0.004, o.depth_m.shape)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.3] = 0
    found = level_pose(replace(o, depth_m=depth))
    assert found[2, 3] == pytest.approx(0.7 * np.sin(np.pi / 4), abs=0.003)


def test_the_observations_own_pose_does_not_count():
    o = observe()
    np.testing.assert_array_equal(level_pose(o), level_pose(replace(o, T_world_camera=np.eye(4))))


def test_no_support_is_no_guess(rng):
    o = observe()
    rough = rng.uniform(0.3, 2.5, o.depth_m.shape).astype(np.float32)
    with pytest.raises(InputError, match="No support was found"):
        level_pose(replace(o, depth_m=rough))
    with pytest.raises(InputError, match="too few readings"):
        level_pose(replace(o, depth_m=np.full_like(o.depth_m, 5.0)))
