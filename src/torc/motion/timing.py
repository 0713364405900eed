"""Paths of straight pieces and quadratic arcs, and their timing.

A trajectory follows exactly the checked path, within the joints' speed and acceleration limits, at rest at both ends.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numba import njit
from scipy.interpolate import CubicSpline

from torc.geometry.transforms import kernel_array
from torc.motion.config import TimingConfig
from torc.records import Trajectory
from torc.robots.description import ArmDescription


@dataclass(frozen=True)
class PiecewisePath:
    """q(s) = points + tangents * t + curvatures * t^2 / 2, with t = s - starts, on each piece.

    The parameter s is arc length on straight pieces and passes corners at the same speed, so the tangent is continuous
    wherever a corner is rounded.

    Attributes:
        starts: value of s at which each piece begins, and finally the end of the path.
        points, tangents, curvatures: q, q' and q'' at the start of each piece.
    """

    starts: Float[np.ndarray, "p_plus_1"]
    points: Float[np.ndarray, "p dof"]
    tangents: Float[np.ndarray, "p dof"]
    curvatures: Float[np.ndarray, "p dof"]

    @property
    def length(self) -> float:
        """The last value of s."""
        return float(self.starts[-1])

    def __call__(self, s: Float[np.ndarray, "n"], order: int = 0) -> Float[np.ndarray, "n dof"]:
        """Return q, or its first or second derivative by s."""
        piece = np.clip(np.searchsorted(self.starts, s, side="right") - 1, 0, len(self.points) - 1)
        t = (np.asarray(s) - self.starts[piece])[:, None]
        if order == 0:
            return self.points[piece] + self.tangents[piece] * t + self.curvatures[piece] * (0.5 * t * t)
        if order == 1:
            return self.tangents[piece] + self.curvatures[piece] * t
        return self.curvatures[piece]

    def grid(self, spacing: float, per_arc: int = 8) -> Float[np.ndarray, "g"]:
        """Return values of s from end to end that contain every piece's ends, evenly between them."""
        parts = []
        for a, b, curvature in zip(self.starts[:-1], self.starts[1:], self.curvatures):
            n = max(per_arc if np.any(curvature) else 2, int(np.ceil((b - a) / spacing)))
            parts.append(np.linspace(a, b, n, endpoint=False))
        return np.append(np.concatenate(parts), self.length)


def rounded_path(path: Float[np.ndarray, "m dof"], blends: Float[np.ndarray, "m"]) -> list[PiecewisePath]:
    """Return the polyline with each corner k rounded from blends[k] before it to blends[k] after it.

    At a corner that is not rounded (blends[k] = 0) the path has to stop, and is cut. Repeated points are left out.
    """
    parts: list[PiecewisePath] = []
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    starts, here = [0.0], path[0]
    for k in range(1, len(path)):
        leg = path[k] - path[k - 1]
        norm = np.linalg.norm(leg)
        if norm < 1e-9:
            continue
        unit = leg / norm
        end = path[k] - unit * blends[k]
        straight = float((end - here) @ unit)
        if straight > 1e-9:
            pieces.append((here, unit, np.zeros_like(unit)))
            starts.append(starts[-1] + straight)
        here = end
        if k < len(path) - 1 and blends[k] > 0:
            following = path[k + 1] - path[k]
            following = following / np.linalg.norm(following)
            pieces.append((here, unit, (following - unit) / (2 * blends[k])))
            starts.append(starts[-1] + 2 * blends[k])
            here = path[k] + following * blends[k]
        elif pieces:
            parts.append(PiecewisePath(np.array(starts), *map(np.array, zip(*pieces))))
            pieces, starts, here = [], [0.0], path[k]
    return parts


def time_path(path: PiecewisePath, arm: ArmDescription, config: TimingConfig) -> Trajectory:
    """Return the fastest motion along a path.

    The trajectory stays on the path exactly: between grid points the speed follows constant path acceleration.
    """
    speed, acceleration = config.speed_scale * arm.max_speed, config.acceleration_scale * arm.max_acceleration
    grid = path.grid(path.length / config.grid_points)
    curvatures = path(grid[:-1], 2)
    starts = path(grid[:-1], 1)
    ends = starts + np.diff(grid)[:, None] * curvatures
    speeds = fastest_speeds(grid, starts, ends, curvatures, speed, acceleration)
    return _sample(path, grid, speeds, config.sample_s)


def join(trajectories: list[Trajectory]) -> Trajectory:
    """Join trajectories one after the other."""
    times, start = [trajectories[0].times_s], trajectories[0].duration_s
    for t in trajectories[1:]:
        times.append(t.times_s[1:] + start)
        start += t.duration_s
    return Trajectory(
        np.concatenate(times),
        np.concatenate([trajectories[0].qpos, *(t.qpos[1:] for t in trajectories[1:])]),
        np.concatenate([trajectories[0].qvel, *(t.qvel[1:] for t in trajectories[1:])]),
    )


def time_line(
    waypoints: Float[np.ndarray, "m dof"],
    distances_m: Float[np.ndarray, "m"],
    max_speed_m_s: float,
    arm: ArmDescription,
    config: TimingConfig,
) -> Trajectory:
    """Return the motion along a straight line of the TCP: its speed rises, holds and falls, within all limits.

    `distances_m`: distance of the TCP from the start at each waypoint, rising from 0; `max_speed_m_s`: of the TCP.
    """
    spline = CubicSpline(distances_m, waypoints)
    s = np.linspace(0.0, distances_m[-1], 4 * len(waypoints))
    first, second = np.abs(spline(s, 1)) + 1e-9, np.abs(spline(s, 2))
    speed_limit = config.speed_scale * arm.max_speed
    acceleration_limit = config.acceleration_scale * arm.max_acceleration
    speed = min(max_speed_m_s, float(np.min(speed_limit / first)))
    # Half of the acceleration is left for the line's curvature in joint space, the rest for speeding up and braking.
    speed = min(speed, float(np.sqrt(np.min(0.5 * acceleration_limit / np.maximum(second, 1e-9)))))
    acceleration = float(np.min((acceleration_limit - second * speed**2) / first))
    ramp = speed / acceleration
    length = float(distances_m[-1])
    if speed * ramp > length:
        ramp = float(np.sqrt(length / acceleration))
        speed = acceleration * ramp
    duration = length / speed + ramp
    times = _sample_times(duration, config.sample_s)
    rest = np.minimum(times, duration - times)
    edge = 0.5 * acceleration * np.minimum(rest, ramp) ** 2
    half = np.where(rest < ramp, edge, 0.5 * speed * ramp + speed * (rest - ramp))
    position = np.where(times <= 0.5 * duration, half, length - half)
    velocity = np.minimum(acceleration * rest, speed)
    return Trajectory(times, spline(position), spline(position, 1) * velocity[:, None])


def _sample(
    path: PiecewisePath, grid: Float[np.ndarray, "g"], speeds: Float[np.ndarray, "g"], sample_s: float
) -> Trajectory:
    """Sample a path in time, with the given speeds (of s) at grid points and constant acceleration between."""
    mean = 0.5 * (speeds[1:] + speeds[:-1])
    at = np.concatenate([[0.0], np.cumsum(np.diff(grid) / np.maximum(mean, 1e-9))])
    times = _sample_times(at[-1], sample_s)
    k = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(grid) - 2)
    t = times - at[k]
    acceleration = (speeds[k + 1] - speeds[k]) / (at[k + 1] - at[k])
    s = np.clip(grid[k] + speeds[k] * t + 0.5 * acceleration * t * t, 0.0, grid[-1])
    speed = np.maximum(speeds[k] + acceleration * t, 0.0)
    qpos, qvel = path(s), path(s, 1) * speed[:, None]
    qvel[0] = qvel[-1] = 0.0
    return Trajectory(times, qpos, qvel)


def _sample_times(duration: float, sample_s: float) -> Float[np.ndarray, "t"]:
    """Return evenly spread times from 0 to the duration, at most sample_s apart."""
    return np.linspace(0.0, duration, max(2, int(np.ceil(duration / sample_s)) + 1))


@njit(cache=True)
def _bounds(start, end, curvature, ds, limits, low, high):
    """Write bounds on u at both ends of an interval, as lines in x at its start.

    That is, low[k, 0] + low[k, 1] x <= u <= high[k, 0] + high[k, 1] x.

    Returns how many, and the largest x on its own. At the end x is x + 2 u ds.
    """
    n, x_max = 0, np.inf
    for j in range(start.shape[0]):
        b = curvature[j]
        for side in range(2):
            a = start[j] if side == 0 else end[j] + 2.0 * ds * b
            if abs(a) < 1e-9:
                if abs(b) > 1e-12:
                    x_max = min(x_max, limits[j] / abs(b))
                continue
            low[n, 0], high[n, 0] = -limits[j] / abs(a), limits[j] / abs(a)
            low[n, 1] = high[n, 1] = -b / a
            n += 1
    return n, x_max


@njit(cache=True)
def _largest_x(low, high, n, x_max):
    """Return the largest x up to x_max at which every lower bound on u is below every upper one."""
    for i in range(n):
        for j in range(n):
            slope = low[i, 1] - high[j, 1]
            if slope > 0.0:
                x_max = min(x_max, (high[j, 0] - low[i, 0]) / slope)
    return x_max


@njit(cache=True)
def _speed_limits(start, end, speed):
    """Return the largest x at each grid point such that no joint is too fast anywhere on the intervals beside it."""
    limit = np.full(start.shape[0] + 1, 1e12)
    for i in range(start.shape[0]):
        for j in range(start.shape[1]):
            fastest = max(abs(start[i, j]), abs(end[i, j]))
            if fastest > 1e-12:
                x = (speed[j] / fastest) ** 2
                limit[i], limit[i + 1] = min(limit[i], x), min(limit[i + 1], x)
    return limit


@njit(cache=True)
def _profile(grid, start, end, curvature, speed, acceleration):
    m, dof = grid.shape[0], start.shape[1]
    limit = _speed_limits(start, end, speed)
    limit[m - 1] = 0.0
    low, high = np.empty((2 * dof, 2)), np.empty((2 * dof, 2))
    for i in range(m - 2, -1, -1):
        ds = grid[i + 1] - grid[i]
        n, x_max = _bounds(start[i], end[i], curvature[i], ds, acceleration, low, high)
        x_max = _largest_x(low, high, n, min(limit[i], x_max))
        # The next point's limit bounds u too: u <= (limit - x) / (2 ds).
        for k in range(n):
            slope = low[k, 1] + 0.5 / ds
            if slope > 0.0:
                x_max = min(x_max, (0.5 * limit[i + 1] / ds - low[k, 0]) / slope)
        limit[i] = x_max
    x = np.zeros(m)
    for i in range(m - 1):
        ds = grid[i + 1] - grid[i]
        n, _ = _bounds(start[i], end[i], curvature[i], ds, acceleration, low, high)
        u = 0.5 * (limit[i + 1] - x[i]) / ds
        for k in range(n):
            u = min(u, high[k, 0] + high[k, 1] * x[i])
        x[i + 1] = min(max(x[i] + 2.0 * ds * u, 0.0), limit[i + 1])
    return np.sqrt(x)


def fastest_speeds(
    grid: Float[np.ndarray, "m"],
    starts: Float[np.ndarray, "m_minus_1 dof"],
    ends: Float[np.ndarray, "m_minus_1 dof"],
    curvatures: Float[np.ndarray, "m_minus_1 dof"],
    max_speed: Float[np.ndarray, "dof"],
    max_acceleration: Float[np.ndarray, "dof"],
) -> Float[np.ndarray, "m"]:
    """Return the path speed ds/dt at each grid point, 0 at both ends.

    `grid`: rising values of the path parameter s; `starts`, `ends`: q' at either end of each interval; `curvatures`:
    q'' on it; then the limits of the joints.
    """
    arrays = (grid, starts, ends, curvatures, max_speed, max_acceleration)
    return _profile(*map(kernel_array, arrays))
