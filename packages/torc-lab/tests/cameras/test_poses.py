"""Where a camera is, as the user says it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from camera_scenes import COLOR, DEPTH, POSE, seen

from torc.errors import InputError
from torc.geometry.transforms import make_pose, rotation_about, wxyz_from_rotation
from torc.perception.stereo import made_up_pair
from torc.registry.settings import changed
from torc.specs.conditions import plain_value
from torc_lab.cameras.poses import placed, read_pose

ROWS = ",".join(str(v) for v in POSE.ravel())


def test_the_workspace_knows(workspace):
    np.testing.assert_array_equal(read_pose("workspace", workspace), workspace.camera.T_world_camera)
    assert read_pose("level", workspace) is None


@pytest.mark.parametrize("given", [ROWS, ROWS.replace(",", " "), f"[{ROWS}]", tuple(POSE.ravel())])
def test_sixteen_numbers_are_a_pose(workspace, given):
    np.testing.assert_allclose(read_pose(given, workspace), POSE)


QUATERNION = {"position": POSE[:3, 3].tolist(), "wxyz": wxyz_from_rotation(POSE[:3, :3]).tolist()}


@pytest.mark.parametrize("data", [{"T_world_camera": POSE.tolist()}, {"camera_pose": QUATERNION}, QUATERNION])
@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_a_file_holds_a_pose(workspace, tmp_path, data, suffix):
    path = tmp_path / f"pose{suffix}"
    path.write_text(json.dumps(data))  # which is YAML too
    np.testing.assert_allclose(read_pose(str(path), workspace), POSE, atol=1e-9)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("1,2,3", "has 3 numbers, not 16"),
        ("wrokspace", "says nothing about where the camera is. Give --camera.pose level"),
        (tuple((2 * POSE).ravel()), "not a rotation"),
        (tuple((POSE @ np.diag([1, 1, -1, 1])).ravel()), "not a rotation"),
        ((float("nan"),) * 16, "16 finite numbers|4x4 finite numbers"),
        ("none.yaml", "none.yaml is missing"),
    ],
)
def test_what_is_no_pose_is_refused(workspace, given, text):
    with pytest.raises(InputError, match=text):
        read_pose(given, workspace)


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("pose.json", "{", "not readable YAML"),
        ("pose.json", "[1]", "holds no camera pose"),
        ("pose.yaml", "position: [1, 2, 3]", r"need position \(3\) and wxyz"),
        ("pose.yaml", "T_world_camera: [[1]]", "4x4 finite numbers"),
        ("pose.yaml", "{x: 0, y: 0, z: 1, qx: 0, qy: 0, qz: 0, qw: 1}", "holds no camera pose"),
    ],
)
def test_files_without_a_pose_are_refused(workspace, tmp_path, name, content, text):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=text):
        read_pose(str(tmp_path / name), workspace)


def test_level_puts_the_support_at_zero():
    o = placed(replace(seen(COLOR, POSE), T_world_camera=np.eye(4)), None)
    assert o.pose_estimated
    assert o.T_world_camera[2, 3] == pytest.approx(POSE[2, 3] - 1.05, abs=0.003)
    given = placed(o, POSE)
    assert not given.pose_estimated


def test_level_without_depth_looks_at_the_pair():
    truth = seen(DEPTH, POSE)
    pair = made_up_pair(truth.depth_m, DEPTH.f)
    o = placed(replace(truth, depth_m=0 * truth.depth_m, pair=pair), None)
    assert not o.depth_m.any()  # it stays as it was
    assert o.T_world_camera[2, 3] == pytest.approx(POSE[2, 3] - 1.05, abs=0.01)


def test_a_camera_that_hangs_upside_down_is_no_other():
    o = seen(COLOR, POSE @ make_pose(rotation_about([0, 0, 1], np.pi)))
    up = placed(o, None).T_world_camera
    assert up[2, 3] == pytest.approx(POSE[2, 3] - 1.05, abs=0.003)
    assert up[2, 1] > 0.5  # the picture's down is up


def test_numbers_of_the_command_line_stay_what_they_are():
    """A serial number is no octal number, and fits where a text is expected."""
    from torc_lab.cameras.realsense import RealSenseConfig

    for text in ("017322071705", "841512070523", "f123"):
        config = changed(RealSenseConfig(), {"serial": plain_value(text)}, "camera")
        assert str(config.serial) == text
