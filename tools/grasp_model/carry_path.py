"""How the gripper gets from the lift to the bin: when it is where on its way, and how it turns."""

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import rotation_about


def smooth_steps(count: int) -> Float[np.ndarray, "k"]:
    """Shares of the way after each of `count` equal times: quintic, at rest at both ends."""
    t = np.arange(1, count + 1) / count
    return t**3 * (10.0 - 15.0 * t + 6.0 * t**2)


def turned_down(
    R: Float[np.ndarray, "3 3"], yaw_rad: float
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """How a gripper turns to point down: angles about its x, then y, then z axis, and where it points then.

    Args:
        R: its orientation in the world, z the approach.
        yaw_rad: turn about the vertical at the end.

    Returns:
        The angles, and the orientation at the end: R @ Rx @ Ry @ Rz.
    """
    down = R.T @ np.array([0.0, 0.0, -1.0])
    # Rx(a) @ Ry(b) takes z to (sin b, -sin a cos b, cos a cos b).
    angles = np.array([np.arctan2(-down[1], down[2]), np.arcsin(np.clip(down[0], -1.0, 1.0)), yaw_rad])
    turn = np.eye(3)
    for axis, angle in zip(np.eye(3), angles):
        turn = turn @ rotation_about(axis, angle)
    return angles, R @ turn
