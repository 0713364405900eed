"""What a motion must keep to before it goes to an arm: speeds, accelerations, and a workspace for the whole arm."""

from dataclasses import replace

import numpy as np
import pytest

from fake_arm import FakeArmDriver
from test_supervisor import QUICK, WIDE, motion, supervised
from torc.records import Trajectory
from torc.robots.kinematics import sphere_centers, tool0_poses
from torc_lab.checks import elbow_link, limits_of, motion_faults, stretch_for, stretched
from torc_lab.protocols import MotionRefusedError
from torc_lab.supervisor import SupervisedArm


def test_the_fingertips_keep_to_reduced_speed_and_joints_to_their_acceleration(robot):
    driver = FakeArmDriver(robot.arm.rest_qpos.copy())
    limits = limits_of(robot, *WIDE, 1.0, 0.01)
    assert limits.tcp_speed_m_s == 0.25
    quick = motion(driver.qpos, by=0.3, duration_s=0.2, n=41)
    slow = stretched(quick, stretch_for(quick, limits, robot))
    tcp = (tool0_poses(robot.arm, slow.qpos) @ robot.gripper.T_tool0_tcp(0.0))[:, :3, 3]
    fastest = (np.linalg.norm(np.diff(tcp, axis=0), axis=1) / np.diff(slow.times_s)).max()
    assert fastest == pytest.approx(0.25, rel=0.05)
    assert motion_faults(slow, driver.qpos, 0.001, limits, robot) == []
    assert "TCP moves at" in " ".join(motion_faults(quick, driver.qpos, 0.001, limits, robot))
    weak = replace(limits, tcp_speed_m_s=99.0, max_acceleration=np.full(7, 0.5))
    slow = stretched(quick, stretch_for(quick, weak, robot))
    hardest = np.abs(np.diff(slow.qvel, axis=0) / np.diff(slow.times_s)[:, None]).max()
    assert hardest == pytest.approx(0.5, rel=0.15)
    assert "accelerates by" in " ".join(motion_faults(quick, driver.qpos, 0.001, weak, robot))
    assert motion_faults(slow, driver.qpos, 0.001, weak, robot) == []


def test_the_elbow_stays_in_the_workspace(robot):
    """Flange and fingertips may be where they are; the elbow of the same configuration is outside."""
    driver = FakeArmDriver(robot.arm.rest_qpos.copy())
    link = robot.spheres.link
    arm_part = (link >= elbow_link(robot)) & (link < robot.arm.dof)
    elbow = sphere_centers(robot, driver.qpos[None], np.zeros(1))[0, arm_part]
    flange = tool0_poses(robot.arm, driver.qpos[None])[0]
    hand = np.array([flange[:3, 3], (flange @ robot.gripper.T_tool0_tcp(0.0))[:3, 3]])
    axis = int((hand.min(axis=0) - elbow.min(axis=0)).argmax())
    low = np.array([-3.0, -3.0, 0.0])
    low[axis] = 0.5 * (hand.min(axis=0) + elbow.min(axis=0))[axis]
    limits = limits_of(robot, low, WIDE[1], 1.0, 0.0)
    with pytest.raises(MotionRefusedError, match=r"elbow on is at .* outside of the workspace"):
        SupervisedArm(driver, robot, limits, QUICK).follow(motion(driver.qpos, by=0.01))
    assert driver.sent == []


@pytest.mark.parametrize("end", [0, -1])
def test_a_motion_that_does_not_begin_and_end_at_rest_is_refused(robot, end, any_arrays):
    driver = FakeArmDriver(robot.arm.rest_qpos.copy())
    arm = supervised(driver, robot)
    good = motion(arm.qpos)
    rates = good.qvel.copy()
    rates[end, 3] = 1.6e-3
    with pytest.raises(MotionRefusedError, match="begins or ends at 0\\.0016 rad/s, not at rest"):
        arm.follow(Trajectory(good.times_s, good.qpos, rates))
    assert driver.sent == []
