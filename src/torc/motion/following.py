"""Following a straight line of poses from a joint configuration: compiled Newton steps along waypoints.

Each waypoint is solved by damped least squares from the one before, so a redundant arm moves as little as it
can.
"""

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from torc.collision.placement import RobotArrays, forward


@njit(cache=True)
def _pose_error(T, target, error):
    """Translation and rotation vector (world) from T to target, both 3 by 4; returns their norms."""
    for i in range(3):
        error[i] = target[i, 3] - T[i, 3]
    # Rotation vector of target @ T^-1; its half-angle form is exact enough for the small turns between
    # waypoints.
    R = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = target[i, 0] * T[j, 0] + target[i, 1] * T[j, 1] + target[i, 2] * T[j, 2]
    sx, sy, sz = 0.5 * (R[2, 1] - R[1, 2]), 0.5 * (R[0, 2] - R[2, 0]), 0.5 * (R[1, 0] - R[0, 1])
    sine = np.sqrt(sx * sx + sy * sy + sz * sz)
    angle = np.arctan2(sine, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0))
    k = angle / sine if sine > 1e-12 else 1.0
    error[3], error[4], error[5] = k * sx, k * sy, k * sz
    return np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2), angle


@njit(cache=True)
def _geometric_jacobian(Ts, axes, J):
    """Jacobian of tool0 (world frame; rows: translation, rotation) from the link poses."""
    dof = axes.shape[0]
    tool = Ts[dof]
    for i in range(dof):
        T, u = Ts[i], axes[i]
        zx = T[0, 0] * u[0] + T[0, 1] * u[1] + T[0, 2] * u[2]
        zy = T[1, 0] * u[0] + T[1, 1] * u[1] + T[1, 2] * u[2]
        zz = T[2, 0] * u[0] + T[2, 1] * u[1] + T[2, 2] * u[2]
        dx, dy, dz = tool[0, 3] - T[0, 3], tool[1, 3] - T[1, 3], tool[2, 3] - T[2, 3]
        J[0, i], J[1, i], J[2, i] = zy * dz - zz * dy, zz * dx - zx * dz, zx * dy - zy * dx
        J[3, i], J[4, i], J[5, i] = zx, zy, zz


@njit(cache=True)
def follow_waypoints(q_start, targets, robot, lower, upper, max_step_rad, tolerance, path):
    """Fill path with a configuration per target pose; returns how many could be reached in a row.

    It ends where a waypoint is not met within the tolerance (metres and radians), a joint limit is passed, or
    a joint changes by more than max_step_rad between two waypoints.
    """
    dof = q_start.shape[0]
    Ts, scratch = np.empty((dof + 1, 3, 4)), np.empty((3, 4))
    J, error = np.empty((6, dof)), np.empty(6)
    damping = 1e-7 * np.eye(6)
    q = q_start.copy()
    for k in range(targets.shape[0]):
        met = False
        for _ in range(12):
            forward(q, robot, Ts, scratch)
            distance, angle = _pose_error(Ts[dof], targets[k], error)
            if distance < tolerance and angle < tolerance:
                met = True
                break
            _geometric_jacobian(Ts, robot.axes, J)
            q += J.T @ np.linalg.solve(J @ J.T + damping, error)
        if not met:
            return k
        previous = path[k - 1] if k > 0 else q_start
        for i in range(dof):
            if q[i] < lower[i] or q[i] > upper[i] or abs(q[i] - previous[i]) > max_step_rad:
                return k
        path[k] = q
    return targets.shape[0]


@njit(cache=True)
def _follow_many(starts, targets, robot, lower, upper, max_step_rad, tolerance, paths, counts):
    for b in range(starts.shape[0]):
        counts[b] = follow_waypoints(
            starts[b], targets, robot, lower, upper, max_step_rad, tolerance, paths[b]
        )


def follow_line(
    robot: RobotArrays,
    starts: Float[np.ndarray, "b dof"],
    Ts_world_tool0: Float[np.ndarray, "m 4 4"],
    lower: Float[np.ndarray, "dof"],
    upper: Float[np.ndarray, "dof"],
    max_step_rad: float = 0.15,
    tolerance: float = 1e-5,
) -> tuple[Float[np.ndarray, "b m dof"], Int[np.ndarray, "b"]]:
    """Joint paths through the poses from each start, and how many poses in a row each path meets."""
    targets = np.ascontiguousarray(Ts_world_tool0[:, :3], dtype=float)
    starts = np.ascontiguousarray(starts, dtype=float)
    paths = np.full((len(starts), len(targets), starts.shape[1]), np.nan)
    counts = np.zeros(len(starts), dtype=np.int64)
    _follow_many(starts, targets, robot, lower, upper, max_step_rad, tolerance, paths, counts)
    return paths, counts


def line_poses(
    T_start: Float[np.ndarray, "4 4"], direction: Float[np.ndarray, "3"], length_m: float, step_m: float
) -> Float[np.ndarray, "m 4 4"]:
    """Poses of equal orientation along a straight line, start not included, end included, at most step_m apart."""
    n = max(1, int(np.ceil(length_m / step_m - 1e-9)))
    poses = np.tile(T_start, (n, 1, 1))
    poses[:, :3, 3] += np.outer(np.arange(1, n + 1) * (length_m / n), direction)
    return poses
