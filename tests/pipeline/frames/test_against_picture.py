"""Poses, heights, units and intrinsics that the picture contradicts."""

from dataclasses import replace

import numpy as np
import pytest
from frame_makers import npz, observe, true_labels

from torc.errors import InputError
from torc.geometry.transforms import invert, rotation_from_wxyz, wxyz_from_rotation
from torc.pipeline.frames import load_frame
from torc.pipeline.frames.against_picture import doubts
from torc.pipeline.frames.plausibility import check_intrinsics, intrinsics_doubts
from torc.records import Capture

SEEN = observe()
T = SEEN.T_world_camera


def doubted(support_z_m, **changes):
    return doubts(Capture(replace(SEEN, **changes), true_labels()), support_z_m)


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
    (message,) = doubted(1.05, T_world_camera=pose)
    assert "tilted" in message
    assert reason in message


def test_a_good_frame_is_not_doubted(tmp_path):
    assert doubted(1.05) == doubted(None) == ()
    assert load_frame(npz(tmp_path)).warnings == ()


@pytest.mark.parametrize("factor", [0.25, 0.1, 10])
def test_a_wrong_unit_shows_in_the_cameras_height(factor):
    (message,) = doubted(1.05, depth_m=SEEN.depth_m * np.float32(factor))
    assert f"{'larger' if factor < 1 else 'smaller'} by a factor of {max(factor, 1 / factor):g}" in message


def test_a_wrong_height_is_doubted():
    (message,) = doubted(0.9)
    assert "at z = 1.050 m, not at support_z_m = 0.900" in message


def test_a_table_whose_height_was_left_out_comes_before_the_unit():
    """The camera is .33 m above the table, 1.38 m above 0: a factor of 4."""
    (message,) = doubted(0.0)
    assert message.index("height of the table left out") < message.index("unit is wrong")


def test_a_unit_that_no_camera_could_see_from_comes_before_the_height():
    """Depth a tenth of what it is: a camera 3 cm above the table."""
    (message,) = doubted(1.05, depth_m=SEEN.depth_m * np.float32(0.1))
    assert message.index("unit is probably wrong") < message.index("check support_z_m")


def test_a_floor_at_the_given_height_does_not_hide_the_table_above_it():
    """A third of the picture shows the floor at z = 0, where the support is said to be."""
    depth = SEEN.depth_m.copy()
    rows, cols = np.mgrid[: depth.shape[0], : depth.shape[1]]
    rays = np.stack(
        [(cols - SEEN.K[0, 2]) / SEEN.K[0, 0], (rows - SEEN.K[1, 2]) / SEEN.K[1, 1], 0 * rows + 1]
    )
    to_floor = -T[2, 3] / np.tensordot(T[2, :3], rays, 1)
    depth[:, :100] = to_floor[:, :100]
    assert "height of the table" in doubted(0.0, depth_m=depth.astype(np.float32))[0]
    assert doubted(1.05, depth_m=depth.astype(np.float32)) == ()


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


@pytest.mark.parametrize(
    ("cx", "cy", "shape", "size"),
    [
        (423.5, 239.5, (480, 640), "848x480"),
        (425.1, 241.0, (480, 640), "848x480"),
        (319.5, 239.5, (512, 512), "640x480"),
        (319.5, 179.5, (480, 640), "640x360"),
    ],
)
def test_intrinsics_that_fit_another_size_better_are_doubted(cx, cy, shape, size):
    K = np.array([[600.0, 0, cx], [0, 600.0, cy], [0, 0, 1]])
    check_intrinsics("it", K, shape)
    (message,) = intrinsics_doubts(K, shape)
    assert f"pictures of {size} pixels" in message


@pytest.mark.parametrize(("cx", "cy"), [(298.4, 247.5), (319.5, 239.5), (340.0, 210.0), (410.0, 239.5)])
def test_intrinsics_of_real_cameras_and_cuts_are_not_doubted(cx, cy):
    assert intrinsics_doubts(np.array([[600.0, 0, cx], [0, 600.0, cy], [0, 0, 1]]), (480, 640)) == ()


def test_a_frame_says_so_of_its_intrinsics(tmp_path):
    K = SEEN.K.copy()
    K[0, 2] = 211.5
    assert any("424x240" in text for text in load_frame(npz(tmp_path, K=K)).warnings)


@pytest.mark.parametrize(("cx", "cy"), [(298.4, 247.5), (319.5, 239.5), (340.0, 210.0)])
def test_intrinsics_of_real_cameras_pass(cx, cy):
    check_intrinsics("it", np.array([[600.0, 0, cx], [0, 600.0, cy], [0, 0, 1]]), (480, 640))


def test_a_refusal_names_the_factor_of_the_unit(tmp_path):
    with pytest.raises(InputError, match="smaller by a factor of 4"):
        load_frame(npz(tmp_path, depth_m=4 * SEEN.depth_m, support_z_m=1.05))
