"""Trajectories stay on their path, within the limits, and at rest at both ends."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.motion.config import TimingConfig
from torc.motion.geometry import rounded_path
from torc.motion.timing import join, time_line, time_path

CONFIG = TimingConfig()


def _polyline(robot, seed, n=5):
    rng = np.random.default_rng(seed)
    return robot.arm.rest_qpos + np.cumsum(rng.normal(0, 0.3, (n, robot.arm.dof)), axis=0)


def _check_limits(t, arm):
    dt = np.diff(t.times_s)
    assert t.times_s[0] == 0
    assert np.all(dt > 0)
    assert np.all(np.abs(t.qvel) <= arm.max_speed * CONFIG.speed_scale + 1e-6)
    np.testing.assert_allclose(t.qvel[[0, -1]], 0, atol=1e-9)
    acceleration = np.abs(np.diff(t.qvel, axis=0) / dt[:, None])
    assert np.all(acceleration <= arm.max_acceleration * CONFIG.acceleration_scale * 1.1 + 1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_of_rounded_paths_are_those_of_their_points(robot, seed):
    path = _polyline(robot, seed)
    (part,) = rounded_path(path, np.array([0, 0.1, 0.2, 0.05, 0]))
    s = np.linspace(1e-3, part.length - 1e-3, 301)
    h = 1e-6
    smooth = ~np.any(np.abs(s[:, None] - part.starts) < 2 * h, axis=1)
    np.testing.assert_allclose(((part(s + h) - part(s - h)) / (2 * h))[smooth], part(s, 1)[smooth], atol=1e-6)
    np.testing.assert_allclose(
        ((part(s + h, 1) - part(s - h, 1)) / (2 * h))[smooth], part(s, 2)[smooth], atol=1e-5
    )
    # The tangent has no jump, and the ends are the polyline's.
    at = part.starts[1:-1]
    np.testing.assert_allclose(part(at - 1e-9, 1), part(at + 1e-9, 1), atol=1e-6)
    np.testing.assert_allclose(part(np.array([0.0, part.length])), path[[0, -1]], atol=1e-12)


def test_a_path_is_cut_where_it_has_to_stop(robot):
    path = _polyline(robot, 1)
    parts = rounded_path(path, np.array([0, 0.1, 0.0, 0.1, 0]))
    assert len(parts) == 2
    np.testing.assert_allclose(parts[0](np.array([parts[0].length]))[0], path[2], atol=1e-12)
    np.testing.assert_allclose(parts[1](np.array([0.0]))[0], path[2], atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_timed_paths_stay_on_the_path_and_within_the_limits(robot, seed):
    path = _polyline(robot, seed)
    (part,) = rounded_path(path, np.array([0, 0.1, 0.2, 0.05, 0]))
    t = time_path(part, robot.arm, CONFIG)
    _check_limits(t, robot.arm)
    np.testing.assert_allclose(t.qpos[[0, -1]], path[[0, -1]], atol=1e-9)
    dense = part(np.linspace(0, part.length, 4000))
    nearest = np.min(np.linalg.norm(t.qpos[:, None] - dense[None], axis=2), axis=1)
    assert nearest.max() < 2e-3
    # As fast as the limits allow: no path can be shorter than its slowest joint at full speed.
    bound = np.max(np.abs(path[-1] - path[0]) / (CONFIG.speed_scale * robot.arm.max_speed))
    assert bound <= t.duration_s < 6 * part.length


def test_joined_trajectories_are_continuous(robot):
    path = _polyline(robot, 2)
    parts = [time_path(p, robot.arm, CONFIG) for p in rounded_path(path, np.zeros(len(path)))]
    t = join(parts)
    _check_limits(t, robot.arm)
    assert t.duration_s == pytest.approx(sum(p.duration_s for p in parts))
    assert np.abs(np.diff(t.qpos, axis=0)).max() < 0.02


@pytest.mark.parametrize("speed", [0.02, 0.15, 5.0])
def test_lines_keep_the_speed_of_the_tcp(robot, speed):
    rng = np.random.default_rng(0)
    s = np.linspace(0, 0.1, 21)
    waypoints = robot.arm.rest_qpos + np.outer(s, rng.normal(0, 3, 7)) + np.outer(s**2, rng.normal(0, 8, 7))
    t = time_line(waypoints, s, speed, robot.arm, CONFIG)
    _check_limits(t, robot.arm)
    np.testing.assert_allclose(t.qpos[[0, -1]], waypoints[[0, -1]], atol=1e-9)
    measured = np.diff(t.qpos, axis=0) / np.diff(t.times_s)[:, None]
    np.testing.assert_allclose(measured, 0.5 * (t.qvel[1:] + t.qvel[:-1]), atol=0.02)
    # The last joint moves monotonically with s here: the TCP's speed can be read from it.
    rate = np.gradient(t.qpos[:, 0], t.times_s) / (
        np.interp(t.qpos[:, 0], *sorted_pair(waypoints[:, 0], np.gradient(waypoints[:, 0], s)))
    )
    assert np.abs(rate).max() <= speed * 1.02


def sorted_pair(x, y):
    order = np.argsort(x)
    return x[order], y[order]


@pytest.mark.parametrize("seed", range(4))
def test_the_profile_is_that_of_the_toppra_library(robot, seed):
    pytest.importorskip("toppra", reason="the extra 'toppra' is for x86-64 only")
    path = _polyline(robot, seed, 6)
    (part,) = rounded_path(path, np.array([0, 0.15, 0.05, 0.2, 0.02, 0]))
    ours = time_path(part, robot.arm, CONFIG)
    theirs = time_path(part, robot.arm, TimingConfig(backend="toppra"))
    # The library takes the sharper of two curvatures on both sides of a grid point where they differ.
    assert 0.98 * theirs.duration_s < ours.duration_s < 1.005 * theirs.duration_s


def test_unknown_backends_are_refused():
    with pytest.raises(InputError, match="compiled"):
        TimingConfig(backend="guess")
