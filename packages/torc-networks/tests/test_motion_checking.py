"""A server's motion, as it is carried out: exact ends, within all limits, and free between the samples too."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from torc.collision.contacts import robot_arrays
from torc.motion.config import MotionConfig, TimingConfig
from torc.motion.space import MotionQuery, free_space
from torc.records import Trajectory
from torc.testing.motion_conformance import requests
from torc_networks.fields import Motion
from torc_networks.motion.checking import UnusableMotionError, stays_free, usable_trajectory

CONFIG = MotionConfig()


@pytest.fixture(scope="module")
def space(robot):
    arm = robot.arm
    limits = arm.lower, arm.upper
    return free_space(
        robot_arrays(robot), requests()[0].world, robot.gripper.max_width_m, limits, arm.max_speed
    )


@pytest.fixture(scope="module")
def free(space, robot):
    """Configurations that touch nothing, off the joint limits: a curve through few samples swings beyond them."""
    low, high = robot.arm.lower, robot.arm.upper
    some = low + (high - low) * np.random.default_rng(3).uniform(0.1, 0.9, (3000, robot.arm.dof))
    return some[~space.collides(some)]


def _motion(*corners, seconds=5.0, samples=60):
    u = np.linspace(0, len(corners) - 1, samples)
    qpos = np.stack([np.interp(u, range(len(corners)), c) for c in np.transpose(corners)], axis=1)
    return Motion(np.linspace(0, seconds, samples), qpos)


@pytest.fixture
def used(robot, space):
    def make(motion, start, *goals, config=CONFIG):
        return usable_trajectory(motion, MotionQuery(space, start, np.stack(goals)), robot.arm, config)

    return make


def test_a_slow_motion_is_carried_out_as_it_is(used, free):
    a, b = free[:2]
    trajectory, chosen = used(_motion(a, b, seconds=60.0), a, b)
    assert (chosen, trajectory.duration_s) == (0, 60.0)
    assert np.diff(trajectory.times_s).max() <= CONFIG.timing.sample_s + 1e-12
    u = (trajectory.qpos - a) @ (b - a) / ((b - a) @ (b - a))
    np.testing.assert_allclose(trajectory.qpos, a + u[:, None] * (b - a), atol=1e-9)
    inner = slice(len(u) // 10, -len(u) // 10)
    np.testing.assert_allclose(u[inner], trajectory.times_s[inner] / 60, atol=1e-9)


def test_the_goal_that_is_reached_is_told(used, free):
    a, b, c, d = free[:4]
    for k in range(3):
        assert used(_motion(a, (b, c, d)[k], seconds=60.0), a, b, c, d)[1] == k


def test_start_and_end_are_made_exact(used, free):
    a, b = free[:2]
    rough = _motion(a + 1e-3, b - 1e-3, seconds=60.0)
    trajectory, _ = used(rough, a, b)
    np.testing.assert_allclose(trajectory.qpos[[0, -1]], [a, b], atol=1e-12)
    assert not trajectory.qvel[[0, -1]].any()
    middle = rough.qpos[len(rough.qpos) // 2]
    assert np.abs(trajectory.qpos - middle).max(axis=1).min() < 2e-3


@pytest.mark.parametrize("off", [0.0021, -0.05, 3.0])
def test_other_starts_and_ends_are_refused(used, free, off):
    a, b = free[:2]
    there = np.zeros(7)
    there[4] = off
    with pytest.raises(UnusableMotionError, match="begins"):
        used(_motion(a + there, b), a, b)
    with pytest.raises(UnusableMotionError, match="ends"):
        used(_motion(a, b + there), a, b)


@pytest.mark.parametrize("samples", [2, 3, 10, 100])
@pytest.mark.parametrize("seconds", [0.01, 1.0, 7.0])
def test_no_motion_is_faster_than_the_arm(used, free, robot, samples, seconds):
    """As the controller carries it out, by cubics between the samples."""
    for k in range(0, 12, 3):
        a, b, c = free[k : k + 3]
        trajectory, _ = used(_motion(a, c, b, seconds=seconds, samples=samples), a, b)
        spline = CubicHermiteSpline(trajectory.times_s, trajectory.qpos, trajectory.qvel)
        fine = np.linspace(0, trajectory.duration_s, 7 * len(trajectory.times_s))
        share = CONFIG.timing
        assert (np.abs(spline(fine, 1)) <= share.speed_scale * robot.arm.max_speed * 1.001).all()
        limit = share.acceleration_scale * robot.arm.max_acceleration
        assert (np.abs(spline(fine, 2)) <= limit * 1.05 + 1e-6).all()


def test_shares_of_the_limits_are_kept(used, free, robot):
    a, b = free[:2]
    slow = MotionConfig(timing=TimingConfig(speed_scale=0.1, acceleration_scale=0.1))
    trajectory, _ = used(_motion(a, b, seconds=0.5), a, b, config=slow)
    assert (np.abs(trajectory.qvel) <= 0.1 * robot.arm.max_speed + 1e-9).all()


def test_slowing_down_does_not_change_the_path(used, free):
    a, b, c = free[:3]
    motion = _motion(a, c, b, seconds=0.2, samples=80)
    trajectory, _ = used(motion, a, b)
    assert trajectory.duration_s > 0.2
    for q in motion.qpos:
        assert np.abs(trajectory.qpos - q).max(axis=1).min() < 0.05


def test_what_leaves_the_limits_is_refused(used, robot, free):
    a, b = free[:2]
    beyond = robot.arm.upper.copy()
    beyond[2] += 0.01
    with pytest.raises(UnusableMotionError, match=r"joint limits by 0.01\d"):
        used(_motion(a, beyond, b, seconds=60.0, samples=201), a, b)


def test_what_takes_too_long_is_refused(used, free):
    a, b = free[:2]
    with pytest.raises(UnusableMotionError, match="would take 121 s"):
        used(_motion(a, b, seconds=121.0), a, b)


def test_free_is_what_touches_nothing_between_the_samples_either(space, free):
    pairs = list(pairwise(free[:300]))
    touching = [p for p in pairs if space.edges_collide(p[0], p[1][None])[0]]
    clear = [p for p in pairs if not space.edges_collide(p[0], p[1][None])[0]]
    assert len(touching) > 20
    assert len(clear) > 5

    def jump(a, b):
        return Trajectory(np.array([0.0, 1.0]), np.stack([a, b]), np.zeros((2, 7)))

    assert all(stays_free(jump(*p), space, 0.0) for p in clear)
    assert not any(stays_free(jump(*p), space, 0.0) for p in touching)


def test_a_single_sample_in_contact_is_enough(space, free, robot):
    some = np.random.default_rng(5).uniform(robot.arm.lower, robot.arm.upper, (300, 7))
    bad = some[space.collides(some)][0]
    qpos = np.stack([free[0], bad, free[0]])
    assert not stays_free(Trajectory(np.arange(3.0), qpos, np.zeros((3, 7))), space, 0.003)
