"""Straight lines: followed exactly, or reported as not followed."""

import numpy as np

from torc.collision.checks import robot_arrays
from torc.motion.config import CartesianConfig
from torc.motion.following import follow_line, line_poses
from torc.motion.lines import line_error, line_fault
from torc.motion.pink_lines import PinkFollower
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
            distance, turn = line_error(arm, path[1:], poses[:n])
            assert distance < 2e-5
            assert turn < 2e-5
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


def test_pink_is_believed_only_where_it_is_on_the_line(robot):
    arm, config = robot.arm, CartesianConfig()
    follower = PinkFollower(arm, config.limit_margin_rad)
    sound = wrong = 0
    for q, T in zip(*_starts(robot, 30)):
        poses = line_poses(T, np.array([0.0, 0.0, 1.0]), 0.2, 0.005)
        path = follower.follow(q, poses, np.tile(q, (len(poses), 1)), 0.03)
        assert path is not None
        fault = line_fault(arm, np.vstack([q, path]), np.concatenate([T[None], poses]), config)
        distance, _ = line_error(arm, path, poses)
        sound += fault is None
        wrong += distance > 0.01
        assert fault is not None or distance <= config.max_deviation_m
    # Both happen: most lines are followed, some are lost without any error.
    assert sound > 10
    assert wrong > 0


def test_faults_are_named(robot):
    arm, config = robot.arm, CartesianConfig()
    q = arm.rest_qpos
    path = np.tile(q, (3, 1))
    poses = tool0_poses(arm, path)
    assert line_fault(arm, path, poses, config) is None
    jump = path.copy()
    jump[1, 0] += 0.5
    assert "jump" in line_fault(arm, jump, poses, config)
    beyond = path.copy()
    beyond[1, 1] = arm.upper[1] + 0.01
    assert "limit" in line_fault(arm, beyond, poses, config)
    off = path.copy()
    off[1:, 3] += 0.02
    assert "off the line" in line_fault(arm, off, poses, config)
    assert "finite" in line_fault(arm, np.full_like(path, np.nan), poses, config)
