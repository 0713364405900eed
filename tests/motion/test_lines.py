"""Straight lines: followed exactly, or reported as not followed."""

import numpy as np

from torc.collision.checks import robot_arrays
from torc.motion.config import CartesianConfig
from torc.motion.following import follow_lines
from torc.robots.kinematics import tool0_poses

CONFIG = CartesianConfig(limit_margin_rad=0.0, max_joint_step_rad=0.15)


def _starts(robot, n=60):
    rng = np.random.default_rng(3)
    arm = robot.arm
    q = np.clip(arm.rest_qpos + rng.normal(0, 0.5, (n, arm.dof)), arm.lower + 0.1, arm.upper - 0.1)
    return q, tool0_poses(arm, q)


def test_what_is_followed_is_on_the_line_within_limits_and_without_jumps(robot):
    arm, arrays = robot.arm, robot_arrays(robot)
    reached = 0
    for q, T in zip(*_starts(robot)):
        direction = np.array([0.0, 0.6, 0.8])
        paths, counts = follow_lines(arm, arrays, q[None], T[None], direction[None], 0.12, CONFIG)
        n = int(counts[0])
        assert paths.shape[1] == 24
        reached += n == 24
        if n:
            path = np.vstack([q, paths[0, :n]])
            poses = np.tile(T, (n, 1, 1))
            poses[:, :3, 3] += np.outer(0.005 * np.arange(1, n + 1), direction)
            np.testing.assert_allclose(tool0_poses(arm, path[1:]), poses, atol=2e-5)
            assert np.all((path[1:] >= arm.lower) & (path[1:] <= arm.upper))
            assert np.abs(np.diff(path, axis=0)).max() <= 0.15
        assert np.all(np.isnan(paths[0, n:]))
    assert 30 < reached < 60


def test_lines_end_where_they_should(robot):
    arm, arrays = robot.arm, robot_arrays(robot)
    up = np.array([[0.0, 0.0, 1.0]])
    T = tool0_poses(arm, arm.rest_qpos[None])
    paths, counts = follow_lines(arm, arrays, arm.rest_qpos[None], T, up, 0.101, CONFIG)
    assert counts[0] == 21
    end = tool0_poses(arm, paths[0, -1:])[0]
    np.testing.assert_allclose(end[:3, 3] - T[0, :3, 3], [0, 0, 0.101], atol=2e-5)
    first, _ = follow_lines(arm, arrays, arm.rest_qpos[None], T, up, 0.101, CONFIG, waypoints=3)
    np.testing.assert_array_equal(first, paths[:, :3])
