"""Trajectories stay on their path, within the limits, and at rest at both ends."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from torc.motion.config import TimingConfig
from torc.motion.timing import fastest_speeds, join, rounded_path, time_line, time_path

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


@pytest.mark.parametrize("phase", [-0.7, 0.0, 2.3])
def test_a_line_that_bends_in_joint_space_leaves_acceleration_for_that(robot, phase):
    """One joint swings to and fro along the line: it speeds up with the line and with the bend at once."""
    s = np.linspace(0, 0.1, 161)
    waypoints = np.tile(robot.arm.rest_qpos, (len(s), 1))
    waypoints[:, 0] += 0.03 * np.sin(125 * s + phase)
    t = time_line(waypoints, s, 5.0, robot.arm, replace(CONFIG, sample_s=0.001))
    acceleration = np.abs(np.diff(t.qvel[:, 0]) / np.diff(t.times_s))
    limit = CONFIG.acceleration_scale * robot.arm.max_acceleration[0]
    assert 0.8 * limit < acceleration.max() <= limit


def sorted_pair(x, y):
    order = np.argsort(x)
    return x[order], y[order]


@pytest.mark.parametrize("seed", range(4))
def test_the_profile_is_the_fastest_one(robot, seed):
    """As a linear program in the squared path speeds: the fastest profile is largest at every grid point at once."""
    (part,) = rounded_path(_polyline(robot, seed, 6), np.array([0, 0.15, 0.05, 0.2, 0.02, 0]))
    grid, speed, acceleration = part.grid(part.length / 100), robot.arm.max_speed, robot.arm.max_acceleration
    ds, bends = np.diff(grid), part(grid[:-1], 2)
    starts = part(grid[:-1], 1)
    ends = starts + ds[:, None] * bends
    m, bounds = len(grid), np.full(len(grid), np.inf)
    for tangents, k in (
        (starts, slice(None, -1)),
        (starts, slice(1, None)),
        (ends, slice(None, -1)),
        (ends, slice(1, None)),
    ):
        bounds[k] = np.minimum(bounds[k], np.min((speed / np.maximum(np.abs(tangents), 1e-12)) ** 2, axis=1))
    bounds[[0, -1]] = 0.0
    rows = []
    for i in range(m - 1):
        for at, tangents in ((i, starts), (i + 1, ends)):
            row = np.zeros((robot.arm.dof, m))
            row[:, i + 1] += tangents[i] / (2 * ds[i])
            row[:, i] -= tangents[i] / (2 * ds[i])
            row[:, at] += bends[i]
            rows += [row, -row]
    limits = np.tile(acceleration, len(rows))
    best = linprog(-np.ones(m), np.vstack(rows), limits, bounds=np.column_stack([np.zeros(m), bounds]))
    assert best.success
    found = fastest_speeds(grid, starts, ends, bends, speed, acceleration)
    np.testing.assert_allclose(found**2, best.x, rtol=1e-6, atol=1e-7)
