"""Forward kinematics against MuJoCo; the Jacobian by finite differences."""

import mujoco
import numpy as np
import pytest

from torc.robots.kernels import jacobian_kernel
from torc.robots.kinematics import link_poses, sphere_centers, tcp_pose, tool0_poses
from torc.robots.loading import load_robot


def random_qpos(arm, n, rng):
    return rng.uniform(arm.lower, arm.upper, (n, arm.dof))


@pytest.fixture(params=["shipped", "other"])
def any_robot(request, robot, write_other_robot):
    return robot if request.param == "shipped" else load_robot(write_other_robot())


def test_flange_and_links_are_where_mujoco_has_them(any_robot, rng):
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


def test_jacobian_by_finite_differences(any_robot, rng):
    arm, h = any_robot.arm, 1e-6
    for q in random_qpos(arm, 10, rng):
        J = np.empty((6, arm.dof))
        jacobian_kernel(link_poses(arm, q[None])[0], arm.axes, J)
        for i in range(arm.dof):
            step = np.zeros(arm.dof)
            step[i] = h
            before, after = tool0_poses(arm, np.stack([q - step, q + step]))
            W = (after - before)[:3, :3] @ tool0_poses(arm, q[None])[0, :3, :3].T / (2 * h)
            expected = [*((after - before)[:3, 3] / (2 * h)), W[2, 1], W[0, 2], W[1, 0]]
            np.testing.assert_allclose(J[:, i], expected, atol=1e-6)


def test_finger_spheres_open_by_half_the_width_each(robot, rng):
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
