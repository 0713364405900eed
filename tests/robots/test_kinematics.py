"""Forward kinematics against MuJoCo; the Jacobian by finite differences."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from torc.robots.description import ArmDescription, RobotDescription
from torc.robots.kinematics import (
    jacobian,
    link_poses,
    sphere_centers,
    tcp_pose,
    tool0_from_tcp,
    tool0_poses,
)
from torc.robots.loading import load_robot


def random_qpos(arm: ArmDescription, n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(arm.lower, arm.upper, (n, arm.dof))


@pytest.fixture(params=["shipped", "other"])
def any_robot(
    request: pytest.FixtureRequest, robot: RobotDescription, write_other_robot: Callable[..., Path]
) -> RobotDescription:
    return robot if request.param == "shipped" else load_robot(write_other_robot())


def test_flange_and_links_are_where_mujoco_has_them(
    any_robot: RobotDescription, rng: np.random.Generator
) -> None:
    arm = any_robot.arm
    model = mujoco.MjModel.from_xml_path(str(any_robot.mjcf_path))
    data = mujoco.MjData(model)
    bodies = [model.jnt_bodyid[model.joint(n).id] for n in arm.joint_names]
    qpos = random_qpos(arm, 50, rng)
    Ts = link_poses(arm, qpos)
    for q, T in zip(qpos, Ts):
        for name, value in zip(arm.joint_names, q):
            data.joint(name).qpos = value
        mujoco.mj_kinematics(model, data)
        site = data.site(any_robot.tool0_site_name)
        np.testing.assert_allclose(T[-1, :3, 3], site.xpos, atol=1e-9)
        np.testing.assert_allclose(T[-1, :3, :3], site.xmat.reshape(3, 3), atol=1e-9)
        np.testing.assert_allclose(T[:-1, :3, :3].reshape(-1, 9), data.xmat[bodies], atol=1e-9)


def test_arm_stretched_sideways_at_zero(robot: RobotDescription) -> None:
    """By hand: shoulder at (.1, -.265, 1.2), then .36 + .36 + .155 m along -y."""
    T = tool0_poses(robot.arm, np.zeros((1, 7)))[0]
    np.testing.assert_allclose(T[:3, 3], [0.1, -0.265 - 0.875, 1.2], atol=1e-9)
    np.testing.assert_allclose(T[:3, 2], [0, -1, 0], atol=1e-9)


def test_jacobian_by_finite_differences(any_robot: RobotDescription, rng: np.random.Generator) -> None:
    arm, h = any_robot.arm, 1e-6
    for q in random_qpos(arm, 10, rng):
        J = jacobian(arm, q)
        for i in range(arm.dof):
            step = np.zeros(arm.dof)
            step[i] = h
            before, after = tool0_poses(arm, np.stack([q - step, q + step]))
            W = (after - before)[:3, :3] @ tool0_poses(arm, q[None])[0, :3, :3].T / (2 * h)
            expected = [*((after - before)[:3, 3] / (2 * h)), W[2, 1], W[0, 2], W[1, 0]]
            np.testing.assert_allclose(J[:, i], expected, atol=1e-6)


def test_wrong_number_of_joints(robot: RobotDescription) -> None:
    with pytest.raises(ValueError, match="7"):
        link_poses(robot.arm, np.zeros((3, 6)))


def test_flange_from_tcp_is_the_inverse_of_tcp_from_flange(
    robot: RobotDescription, rng: np.random.Generator
) -> None:
    qpos, widths = random_qpos(robot.arm, 5, rng), rng.uniform(0, 0.085, 5)
    Ts = np.array([tcp_pose(robot, q, w) for q, w in zip(qpos, widths)])
    np.testing.assert_allclose(
        tool0_from_tcp(robot.gripper, Ts, widths), tool0_poses(robot.arm, qpos), atol=1e-12
    )


def test_finger_spheres_open_by_half_the_width_each(
    robot: RobotDescription, rng: np.random.Generator
) -> None:
    q, dof = random_qpos(robot.arm, 1, rng), robot.arm.dof
    T0, T1 = tcp_pose(robot, q[0], 0.0), tcp_pose(robot, q[0], 0.06)
    closed, opened = (sphere_centers(robot, q, np.array([w]))[0] for w in (0.0, 0.06))
    for link, sign in ((dof + 1, -1.0), (dof + 2, 1.0)):
        mine = robot.spheres.link == link
        moved = opened[mine] - closed[mine]
        expected = T1[:3, 3] - T0[:3, 3] + sign * 0.03 * T1[:3, 0]
        np.testing.assert_allclose(moved, np.broadcast_to(expected, moved.shape), atol=1e-6)
    body = robot.spheres.link <= dof
    np.testing.assert_allclose(opened[body], closed[body])
