"""Poses, heights, units and intrinsics that the picture contradicts."""

from dataclasses import replace

import numpy as np
import pytest
from frame_makers import npz, observe

from torc.errors import InputError
from torc.geometry.transforms import invert, rotation_from_wxyz, wxyz_from_rotation
from torc.pipeline.frames import load_frame
from torc.pipeline.frames.against_picture import doubts
from torc.pipeline.frames.checks import check_intrinsics

SEEN = observe()
T = SEEN.T_world_camera


def reordered():
    pose = T.copy()
    pose[:3, :3] = rotation_from_wxyz(np.roll(wxyz_from_rotation(T[:3, :3]), -1))
    return pose


@pytest.mark.parametrize(
    ("pose", "reason"),
    [
        (invert(T), "Its inverse fits"),
        (T @ np.diag([1.0, -1.0, -1.0, 1.0]), "OpenGL"),
        (reordered(), "xyzw"),
    ],
)
def test_a_pose_that_tilts_the_table_is_doubted_and_the_mistake_named(pose, reason):
    (message,) = doubts(replace(SEEN, T_world_camera=pose), 1.05)
    assert "tilted" in message
    assert reason in message


def test_a_good_frame_is_not_doubted(tmp_path):
    assert doubts(SEEN, 1.05) == doubts(SEEN, None) == ()
    assert load_frame(npz(tmp_path)).warnings == ()


@pytest.mark.parametrize("factor", [0.25, 0.1])
def test_a_wrong_unit_shows_in_the_cameras_height(factor):
    (message,) = doubts(replace(SEEN, depth_m=SEEN.depth_m * np.float32(factor)), 1.05)
    assert f"larger by a factor of {1 / factor:g}" in message


def test_a_wrong_height_is_doubted():
    (message,) = doubts(SEEN, 0.9)
    assert "No level surface lies at support_z_m = 0.900" in message


@pytest.mark.parametrize(
    ("cx", "cy", "text"),
    [
        (639.5, 359.5, "another size"),
        (159.5, 119.5, "320x240"),
        (239.5, 319.5, "exchanged"),
        (60.0, 239.5, "another size"),
    ],
)
def test_intrinsics_of_another_picture_are_refused(cx, cy, text):
    K = np.array([[600.0, 0, cx], [0, 600.0, cy], [0, 0, 1]])
    with pytest.raises(InputError, match=text):
        check_intrinsics("it", K, (480, 640))


@pytest.mark.parametrize(("cx", "cy"), [(298.4, 247.5), (319.5, 239.5), (340.0, 210.0)])
def test_intrinsics_of_real_cameras_pass(cx, cy):
    check_intrinsics("it", np.array([[600.0, 0, cx], [0, 600.0, cy], [0, 0, 1]]), (480, 640))


def test_a_refusal_names_the_factor_of_the_unit(tmp_path):
    with pytest.raises(InputError, match="smaller by a factor of 4"):
        load_frame(npz(tmp_path, depth_m=4 * SEEN.depth_m, support_z_m=1.05))
