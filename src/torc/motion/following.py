"""Follow a straight line of poses from a joint configuration, by compiled Newton steps along waypoints.

Each waypoint is solved by damped least squares from the one before, so a redundant arm moves as little as it can.
"""

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from torc.collision.placement import RobotArrays
from torc.geometry.transforms import kernel_array
from torc.motion.config import CartesianConfig
from torc.robots.description import ArmDescription
from torc.robots.kinematics import forward, jacobian, pose_error

_TOLERANCE = 1e-5
"""Metres and radians, per axis."""


@njit(cache=True)
def follow_waypoints(q_start, targets, robot, lower, upper, max_step_rad, tolerance, path):
    """Fill path with a configuration per target pose; return how many were reached in a row.

    It ends at the first waypoint that is not met within the tolerance (metres and radians, per axis), passes a joint
    limit, or changes a joint by more than max_step_rad.
    """
    dof = q_start.shape[0]
    Ts, scratch = np.empty((dof + 1, 3, 4)), np.empty((2, 3, 4))
    J, error = np.empty((6, dof)), np.empty(6)
    damping = 1e-7 * np.eye(6)
    q = q_start.copy()
    for k in range(targets.shape[0]):
        met = False
        for _ in range(12):
            forward(q, robot, Ts, scratch)
            if pose_error(Ts[dof], targets[k], error) < tolerance:
                met = True
                break
            jacobian(Ts, robot.axes, J)
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
def _follow_each(
    starts, Ts, directions, spacing_m, robot, lower, upper, max_step_rad, tolerance, paths, counts
):
    m = paths.shape[1]
    targets = np.empty((m, 3, 4))
    for b in range(starts.shape[0]):
        for k in range(m):
            targets[k] = Ts[b]
            for i in range(3):
                targets[k, i, 3] += (k + 1) * spacing_m * directions[b, i]
        counts[b] = follow_waypoints(
            starts[b], targets, robot, lower, upper, max_step_rad, tolerance, paths[b]
        )


def follow_lines(
    arm: ArmDescription,
    robot: RobotArrays,
    starts: Float[np.ndarray, "b dof"],
    Ts_world_tool0: Float[np.ndarray, "b 4 4"],
    directions: Float[np.ndarray, "b 3"],
    length_m: float,
    config: CartesianConfig,
    waypoints: int | None = None,
) -> tuple[Float[np.ndarray, "b m dof"], Int[np.ndarray, "b"]]:
    """Return joint paths along straight lines of the flange, each from its own configuration, pose and direction.

    Args:
        arm, robot: the arm, and its robot's arrays.
        starts: not included in the paths.
        Ts_world_tool0: poses at the starts; the orientation is kept.
        directions: unit vectors, world frame.
        length_m: length of the lines, in steps of at most config.step_m.
        config: distance to the joint limits, largest change of a joint per step.
        waypoints: number of waypoints from the start; None for all.

    Returns:
        The paths, NaN beyond their end, and how many waypoints in a row each one meets.
    """
    steps = waypoints_of(length_m, config.step_m)
    starts, margin = kernel_array(starts), config.limit_margin_rad
    paths = np.full((len(starts), waypoints or steps, starts.shape[1]), np.nan)
    counts = np.zeros(len(starts), dtype=np.int64)
    _follow_each(
        starts,
        kernel_array(Ts_world_tool0[:, :3]),
        kernel_array(directions),
        length_m / steps,
        robot,
        kernel_array(arm.lower + margin),
        kernel_array(arm.upper - margin),
        config.max_joint_step_rad,
        _TOLERANCE,
        paths,
        counts,
    )
    return paths, counts


def waypoints_of(length_m: float, step_m: float) -> int:
    """Return the number of waypoints of a line, not counting its start."""
    return max(1, int(np.ceil(length_m / step_m - 1e-9)))
