"""UR5e and Panda against their makers' tables, Denavit-Hartenberg parameters and limits; and how they stand there."""

import numpy as np
import pytest

from torc.geometry.transforms import make_pose, rotation_about
from torc.problems.problem import load_problem
from torc.records import ROBOT
from torc.robots.kinematics import link_poses, tcp_pose, tool0_poses
from torc.robots.loading import load_robot
from torc.sim.actuation import SimulatedGripper
from torc.sim.robot import SimulatedCamera
from torc.sim.simulated_world import build_world
from torc.sim.stepping import Stepper
from torc.workspace.workspace_files import load_workspace

UR5E = [
    (0.0, 0.1625, 90),
    (-0.425, 0.0, 0),
    (-0.3922, 0.0, 0),
    (0.0, 0.1333, 90),
    (0.0, 0.0997, -90),
    (0.0, 0.0996, 0),
]
"""Universal Robots, "DH parameters for calculations of kinematics and dynamics": a, d (m), alpha (deg) per joint."""
PANDA = [
    (0.0, 0.333, 0), (0.0, 0.0, -90), (0.0, 0.316, 90), (0.0825, 0.0, 90), (-0.0825, 0.384, -90), (0.0, 0.0, 90),
    (0.088, 0.0, 90), (0.0, 0.107, 0),
]  # fmt: skip
"""Franka, "Robot and interface specifications", Craig's convention: a, d (m), alpha (deg) per joint, and the flange."""


def turn(axis, angle):
    return make_pose(rotation_about(axis, angle))


def shift(x, z):
    return make_pose(p=np.array([x, 0.0, z]))


def ur5e_flange(qpos):
    T = np.eye(4)
    for (a, d, alpha), q in zip(UR5E, qpos, strict=True):
        T = T @ turn([0, 0, 1], q) @ shift(a, d) @ turn([1, 0, 0], np.deg2rad(alpha))
    return T


def panda_flange(qpos):
    T = np.eye(4)
    for (a, d, alpha), q in zip(PANDA, [*qpos, 0.0], strict=True):
        T = T @ turn([1, 0, 0], np.deg2rad(alpha)) @ shift(a, 0.0) @ turn([0, 0, 1], q) @ shift(0.0, d)
    return T


@pytest.mark.parametrize(
    ("name", "flange", "at_zero"),
    [
        ("ur5e_2f85", ur5e_flange, [-0.8172, -0.2329, 0.0628]),
        ("panda_hand", panda_flange, [0.088, 0.0, 0.926]),
    ],
)
def test_the_flange_is_where_the_makers_table_has_it(name, flange, at_zero, rng):
    arm = load_robot(name).arm
    qpos = rng.uniform(arm.lower, arm.upper, (200, arm.dof))
    expected = np.array([arm.T_world_base @ flange(q) for q in qpos])
    np.testing.assert_allclose(tool0_poses(arm, qpos), expected, atol=1e-6)
    np.testing.assert_allclose(flange(np.zeros(arm.dof))[:3, 3], at_zero, atol=1e-9)


def test_the_makers_limits():
    panda = load_robot("panda_hand").arm
    np.testing.assert_allclose(panda.lower, [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
    np.testing.assert_allclose(panda.upper, [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
    assert np.all(panda.max_speed <= [2.175] * 4 + [2.61] * 3)
    assert np.all(panda.max_acceleration <= 7.5)
    ur = load_robot("ur5e_2f85").arm
    assert np.all(np.abs([ur.lower, ur.upper]) <= 2 * np.pi)
    assert np.all(ur.max_speed <= np.pi)


def test_the_hands():
    panda, ur = load_robot("panda_hand"), load_robot("ur5e_2f85")
    assert panda.gripper.max_width_m == 0.08
    T = panda.gripper.T_tool0_tcp(0.04)
    # The maker's TCP, 103.4 mm from the flange, is in the middle of the pads; closing is along the hand's y.
    assert T[2, 3] - panda.gripper.pad_height_m / 2 == pytest.approx(0.1034, abs=0.001)
    hand = rotation_about([0, 0, 1], -np.pi / 4)
    np.testing.assert_allclose(T[:3, 0], hand[:, 1], atol=1e-6)
    default = load_robot().gripper
    for name in ("widths_m", "actuator_ctrl", "finger_boxes_table", "palm_boxes_table"):
        np.testing.assert_allclose(getattr(ur.gripper, name), getattr(default, name), atol=1e-9)


def test_it_waits_out_of_sight_above_the_bins_rim(robot, workspace):
    world = build_world(load_problem("validation-structured-02"), robot, workspace)
    with SimulatedCamera(world) as camera:
        assert not (camera.capture().label_image == ROBOT).any()
    rim = workspace.bin.center[2] + workspace.bin.inner_size[2]
    assert tcp_pose(robot, robot.arm.rest_qpos, 0.0)[2, 3] > rim


def test_the_bodies_of_the_ur_are_on_the_axes_of_its_table(rng):
    """Links of the maker's frames: the wrists' distances show that no offset hides in another."""
    arm = load_robot("ur5e_2f85").arm
    for q in rng.uniform(arm.lower, arm.upper, (20, 6)):
        p = link_poses(arm, q[None])[0, :, :3, 3]
        lengths = np.linalg.norm(np.diff(p, axis=0), axis=1)[1:]
        np.testing.assert_allclose(lengths, [0.425, 0.3922, 0.1333, 0.0997, 0.0996])


@pytest.fixture(scope="module")
def panda_gripper():
    """Panda's hand in the simulator, and what makes time pass."""
    robot = load_robot("panda_hand")
    stepper = Stepper(build_world(load_problem("validation-structured-02"), robot, load_workspace()))
    return SimulatedGripper(stepper, robot), stepper


def test_the_simulated_hand_goes_where_it_is_told_as_fast_as_the_real_one(panda_gripper):
    gripper, stepper = panda_gripper
    for width_m in (0.08, 0.03, 0.06):
        assert gripper.open(width_m).width_m == pytest.approx(width_m, abs=0.001)
    closed = gripper.close(50.0)
    assert closed.width_m < 0.0015
    assert not closed.holding
    gripper.begin_opening(0.08)
    stepper.run(0.2)
    # Each finger moves at 50 mm/s, or a little more.
    assert 0.01 < gripper.width_m < 2 * 0.2 * 0.08
