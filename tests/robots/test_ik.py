"""Laws of inverse kinematics: what comes back reproduces the pose, within limits, each branch once."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from torc.errors import InputError
from torc.robots import ik
from torc.robots.ik import IkConfig, solve_ik
from torc.robots.ik_seven import detect_offset_wrist, detect_srs
from torc.robots.ik_six import detect_parallel
from torc.robots.kinematics import (
    jacobian,
    link_poses,
    pose_error,
    pose_step,
    sphere_centers,
    tcp_pose,
    tool0_poses,
)
from torc.robots.loading import load_robot
from torc.robots.names import robot_names


def reachable(arm, n, rng):
    return tool0_poses(arm, rng.uniform(arm.lower, arm.upper, (n, arm.dof)))


def without_structure(arm):
    """The same arm, but its last two axes pass by each other."""
    shifted = arm.Ts_parent_joint.copy()
    shifted[5, :3, 3] += 0.01
    return replace(arm, Ts_parent_joint=shifted)


def check_laws(arm, Ts, solutions):
    """Every solution is a pre-image within the limits; nothing but NaN beyond the count."""
    valid = np.arange(solutions.qpos.shape[1]) < solutions.count[:, None]
    np.testing.assert_array_equal(np.isnan(solutions.qpos).any(axis=2), ~valid)
    q = solutions.qpos[valid]
    np.testing.assert_allclose(tool0_poses(arm, q), Ts[np.nonzero(valid)[0]], atol=1e-6)
    assert np.all(q >= arm.lower)
    assert np.all(q <= arm.upper)


BRANCHES = {"sda10f_2f85": 50, "panda_hand": 20, "ur5e_2f85": 8}
"""Of random poses, at least so many in the mean."""


class TestClosedForm:
    def test_round_trip(self, robot, rng):
        Ts = reachable(robot.arm, 3000, rng)
        solutions = solve_ik(robot.arm, Ts)
        assert solutions.count.min() >= 1
        assert solutions.count.mean() > BRANCHES[robot.name]
        check_laws(robot.arm, Ts, solutions)

    def test_parallel_axes_may_point_either_way(self, write_other_robot, rng):
        arm = load_robot(write_other_robot()).arm
        for turned in ([], [1], [2], [3]):
            axes = arm.axes.copy()
            axes[turned] *= -1
            arm = replace(arm, axes=axes)
            assert detect_parallel(arm) is not None
            Ts = reachable(arm, 300, rng)
            solutions = solve_ik(arm, Ts)
            assert solutions.count.min() >= 1
            check_laws(arm, Ts, solutions)

    def test_six_joints_give_back_the_very_configuration(self, rng):
        arm = load_robot("ur5e_2f85").arm
        qpos = random_qpos(arm, 1000, rng)
        solutions = solve_ik(arm, tool0_poses(arm, qpos))
        for i, q in enumerate(qpos):
            assert np.abs(solutions.of(i) - q).max(axis=1).min() < 1e-6

    def test_branches_are_distinct(self, robot, rng):
        solutions = solve_ik(robot.arm, reachable(robot.arm, 50, rng))
        for i in range(50):
            q = solutions.of(i)
            gaps = np.abs(q[:, None] - q[None]).max(axis=-1) + 10.0 * np.eye(len(q))
            assert gaps.min() > 1e-4

    def test_singular_configurations(self, robot):
        """Stretched, wrist straight, shoulder straight: still solved, and exactly."""
        dof = robot.arm.dof
        q = np.zeros((5, dof))
        q[1, 3], q[2, 1], q[3, 5] = 1.2, 0.7, 0.4
        q[4] = [0.3, 0.0, 0.2, -1.0, 0.5, 0.0, 0.1][:dof]
        q = np.clip(q, robot.arm.lower, robot.arm.upper)
        Ts = tool0_poses(robot.arm, q)
        solutions = solve_ik(robot.arm, Ts)
        assert np.all(solutions.count >= 1)
        check_laws(robot.arm, Ts, solutions)

    def test_out_of_reach(self, robot):
        T = np.eye(4)
        T[:3, 3] = 1.7, 0.0, 1.0
        near_shoulder = np.eye(4)
        near_shoulder[:3, 3] = link_poses(robot.arm, robot.arm.rest_qpos[None])[0, 1, :3, 3] + [0, 0, 0.05]
        solutions = solve_ik(robot.arm, np.stack([T, near_shoulder]))
        assert solutions.count.tolist() == [0, 0]
        assert np.isnan(solutions.qpos).all()

    def test_full_turns_are_offered_where_limits_allow(self, rng):
        robot, wide = load_robot(), np.array([0, 0, 0, 0, 0, 0, np.pi])
        arm = replace(robot.arm, lower=robot.arm.lower - wide, upper=robot.arm.upper + wide)
        Ts = reachable(robot.arm, 100, rng)
        solutions = solve_ik(arm, Ts, IkConfig(max_branches=400))
        check_laws(arm, Ts, solutions)
        once = solve_ik(robot.arm, Ts, IkConfig(max_branches=400))
        assert np.array_equal(solutions.count, 2 * once.count)


class TestNumerical:
    def test_other_arms_are_solved_too(self, write_other_robot, rng):
        arm = without_structure(load_robot(write_other_robot()).arm)
        assert detect_srs(arm) is None
        assert detect_offset_wrist(arm) is None
        assert detect_parallel(arm) is None
        Ts = reachable(arm, 100, rng)
        solutions = solve_ik(arm, Ts)
        assert (solutions.count > 0).mean() > 0.97
        check_laws(arm, Ts, solutions)

    def test_agrees_with_the_closed_form_on_what_is_reachable(self, robot, rng, monkeypatch):
        Ts = reachable(robot.arm, 60, rng)
        Ts[::3, :3, 3] += 0.5 * rng.standard_normal((20, 3))
        closed = solve_ik(robot.arm, Ts, IkConfig(swivel_angles=64, max_branches=600))
        monkeypatch.setattr(ik, "closed_form", lambda arm, config: None)
        numeric = solve_ik(robot.arm, Ts)
        check_laws(robot.arm, Ts, numeric)
        assert np.mean((closed.count > 0) == (numeric.count > 0)) > 0.95


class TestStructure:
    def test_the_default_arm_is_srs(self):
        structure = detect_srs(load_robot().arm)
        assert structure is not None
        np.testing.assert_allclose(structure.shoulder, [0.1, -0.265, 1.2], atol=1e-9)
        np.testing.assert_allclose(structure.wrist, [0.1, -0.985, 1.2], atol=1e-9)

    def test_each_shipped_arm_has_one(self, robot):
        detected = [detect(robot.arm) is not None for detect in (detect_srs, detect_parallel)]
        assert sum(detected) == (robot.name != "panda_hand")
        assert (detect_offset_wrist(robot.arm) is not None) == (robot.arm.dof == 7)

    def test_axes_that_pass_by_each_other_are_none(self):
        for name in ("ur5e_2f85", "panda_hand"):
            other = without_structure(load_robot(name).arm)
            assert detect_parallel(other) is None
            assert detect_offset_wrist(other) is None


@pytest.mark.usefixtures("any_arrays")
def test_poses_that_are_none(robot):
    with pytest.raises(InputError, match="not a rigid"):
        solve_ik(robot.arm, 2.0 * np.eye(4)[None])
    with pytest.raises(InputError, match="must be"):
        solve_ik(robot.arm, np.eye(4))
    assert len(solve_ik(robot.arm, np.zeros((0, 4, 4))).count) == 0


def random_qpos(arm, n, rng):
    return rng.uniform(arm.lower, arm.upper, (n, arm.dof))


@pytest.fixture(params=[*robot_names(), "other"])
def any_robot(request, write_other_robot):
    return load_robot(write_other_robot() if request.param == "other" else request.param)


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
        jacobian(link_poses(arm, q[None])[0], arm.axes, J)
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


@pytest.mark.parametrize("dof", [6, 7])
@pytest.mark.parametrize("damping", [1e-7, 10.0])
def test_a_step_solves_the_damped_equations(rng, dof, damping):
    for _ in range(20):
        J, error, step = rng.normal(size=(6, dof)), rng.normal(size=6), np.empty(dof)
        pose_step(J, error, damping, np.empty((7, 6)), step)
        np.testing.assert_allclose(
            step, J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), error), rtol=1e-6
        )


def test_a_pose_that_is_no_number_is_never_met(robot):
    arm = robot.arm
    T = tool0_poses(arm, arm.rest_qpos[None])[0][:3].copy()
    broken, error = T.copy(), np.empty(6)
    broken[0, 3] = np.nan
    assert pose_error(T, T, error) < 1e-12
    assert not pose_error(broken, T, error) < 1e6
