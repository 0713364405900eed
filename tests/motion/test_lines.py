"""Straight lines: followed exactly, or reported as not followed."""

import numpy as np

from torc.collision.checks import robot_arrays
from torc.motion.following import follow_line, line_poses
from torc.robots.kinematics import tool0_poses


def _starts(robot, n=60):
    rng = np.random.default_rng(3)
    arm = robot.arm
    q = np.clip(arm.rest_qpos + rng.normal(0, 0.5, (n, arm.dof)), arm.lower + 0.1, arm.upper - 0.1)
    return q, tool0_poses(arm, q)


def test_what_is_followed_is_on_the_line_within_limits_and_without_jumps(robot):
    arm, arrays = robot.arm, robot_arrays(robot)
    reached = 0
    for q, T in zip(*_starts(robot)):
        poses = line_poses(T, np.array([0.0, 0.6, 0.8]), 0.12, 0.005)
        paths, counts = follow_line(arrays, q[None], poses, arm.lower, arm.upper, 0.15)
        n = int(counts[0])
        reached += n == len(poses)
        if n:
            path = np.vstack([q, paths[0, :n]])
            np.testing.assert_allclose(tool0_poses(arm, path[1:]), poses[:n], atol=2e-5)
            assert np.all((path[1:] >= arm.lower) & (path[1:] <= arm.upper))
            assert np.abs(np.diff(path, axis=0)).max() <= 0.15
        assert np.all(np.isnan(paths[0, n:]))
    assert 30 < reached < 60


def test_lines_end_where_they_should(robot):
    _, T = _starts(robot, 1)
    poses = line_poses(T[0], np.array([0.0, 0.0, 1.0]), 0.101, 0.005)
    np.testing.assert_allclose(poses[-1][:3, 3] - T[0, :3, 3], [0, 0, 0.101], atol=1e-12)
    assert np.linalg.norm(poses[0, :3, 3] - T[0, :3, 3]) <= 0.005
    np.testing.assert_array_equal(poses[:, :3, :3], np.broadcast_to(T[0, :3, :3], (len(poses), 3, 3)))
