"""The touch test: above the marker, the gripper pointing down, by a motion that the supervisor lets go."""

import numpy as np
import pytest

from torc.robots.kinematics import tcp_pose
from torc_lab.calibration.marker import TableMarker
from torc_lab.calibration.touch import ABOVE_M, touch_motion
from torc_lab.checks import motion_faults, stretch_for, stretched
from torc_lab.devices import limits
from torc_lab.lab_file import example_labs, load_lab


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    path = tmp_path_factory.mktemp("lab") / "lab.yaml"
    path.write_text(example_labs()["sda10f-simple-message"], encoding="utf-8")
    return load_lab(path)


def marker_at(lab, x, y):
    half = 0.05
    z = lab.workspace.support_z_m
    return TableMarker(
        np.array([[x + a * half, y + b * half, z] for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))])
    )


def test_the_fingertips_come_to_above_the_markers_middle(lab):
    arm, gripper = lab.robot.arm, lab.robot.gripper
    motion = touch_motion(lab, marker_at(lab, 0.6, -0.2), arm.rest_qpos)
    assert motion is not None
    np.testing.assert_allclose(motion.qpos[0], arm.rest_qpos)
    end = tcp_pose(lab.robot, motion.qpos[-1], gripper.max_width_m)
    np.testing.assert_allclose(end[:3, 3], [0.6, -0.2, lab.workspace.support_z_m + ABOVE_M], atol=2e-3)
    assert end[2, 2] < -0.999
    within = limits(lab)
    slow = stretched(motion, stretch_for(motion, within, lab.robot))
    assert motion_faults(slow, arm.rest_qpos, 1e-6, within, lab.robot) == []


def test_a_marker_out_of_reach_has_no_touch_test(lab):
    assert touch_motion(lab, marker_at(lab, 1.6, -0.2), lab.robot.arm.rest_qpos) is None
