"""The fastest speed profile along a path: TOPP-RA (Pham and Pham, IEEE T-RO 2018), compiled.

With x the squared path speed and u the path acceleration, each joint obeys |q' u + q'' x| <= a and |q'| sqrt(x) <= v.
Between grid points u is constant, so x grows by 2 u ds. A backward pass finds the largest x from which the end can
be reached at rest, a forward pass takes the largest u that stays below it. With one unknown left the linear programs
of the paper are solved exactly by comparing all pairs of bounds on u. On paths whose q'' is constant between grid
points the limits hold at every s, not only at grid points.
"""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.geometry.transforms import kernel_array


@njit(cache=True)
def _bounds(start, end, curvature, ds, limits, low, high):
    """Bounds on u at both ends of an interval, as lines in x at its start: low[k, 0] + low[k, 1] x <= u <= high[...].

    Returns how many, and the largest x by itself. At the end x is x + 2 u ds.
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
    """Largest x up to x_max at which every lower bound on u is below every upper one."""
    for i in range(n):
        for j in range(n):
            slope = low[i, 1] - high[j, 1]
            if slope > 0.0:
                x_max = min(x_max, (high[j, 0] - low[i, 0]) / slope)
    return x_max


@njit(cache=True)
def _speed_limits(start, end, speed):
    """Largest x at each grid point such that no joint is too fast anywhere on the intervals beside it."""
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
    """Path speed ds/dt at each grid point, 0 at both ends.

    Args:
        grid: values of the path parameter s, rising.
        starts, ends: q' at the start and at the end of each interval.
        curvatures: q'' on each interval.
        max_speed, max_acceleration: of the joints.
    """
    arrays = (grid, starts, ends, curvatures, max_speed, max_acceleration)
    return _profile(*map(kernel_array, arrays))
