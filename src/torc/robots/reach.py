"""Find the points that an arm reaches with its fingertips, ignoring obstacles."""

import numpy as np
from jaxtyping import Bool, Float

from torc.geometry.transforms import Pose, invert, make_pose
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik

_TILTS_RAD = (0.0, np.pi / 4, np.pi / 2)
"""Tilts of the approach: straight down, slanting, level."""


def reached(robot: RobotDescription, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
    """Check whether the half-open gripper's TCP reaches each point (world frame, metres), ignoring collisions.

    It comes from above, slanting, or level and away from the base.
    """
    T_tcp_tool0 = invert(robot.gripper.T_tool0_tcp(robot.gripper.max_width_m / 2))
    Ts = [_approach(robot, point, tilt) @ T_tcp_tool0 for point in points for tilt in _TILTS_RAD]
    found = solve_ik(robot.arm, np.array(Ts)).count > 0
    return np.asarray(found.reshape(len(points), -1).any(axis=1))


def _approach(robot: RobotDescription, point: Float[np.ndarray, "3"], tilt_rad: float) -> Pose:
    """Return the TCP's pose at a point: z the approach, tilted from straight down away from the base; x level."""
    away = point[:2] - robot.arm.T_world_base[:2, 3]
    distance = float(np.linalg.norm(away))
    away = (
        away / distance if distance > 1e-6 else np.array([1.0, 0.0])
    )  # above the base every direction leads away
    z = np.array([*(np.sin(tilt_rad) * away), -np.cos(tilt_rad)])
    x = np.array([-away[1], away[0], 0.0])
    return make_pose(np.column_stack([x, np.cross(z, x), z]), point)
