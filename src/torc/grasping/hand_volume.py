"""Where a point, or the table, is relative to the gripper: in the fingers' sweep, in the palm, between the pads.

Points are given in the grasp frame; `sizes`, `palm`, `palm_ranges` and `reach_m` are those of `HandGeometry`, and
`shift_z` = -reach_at(width) is how far the open gripper is drawn back from the closed one.
"""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.grasping.hand import FINGER_X, FINGER_Y, FINGER_Z, OPEN, PAD_Y, PAD_Z, HandGeometry, sweep_end_z


def hand_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Lower and upper corner, in the grasp frame, of a box that holds the gripper at any opening."""
    half_x, half_y = hand.sizes[OPEN] / 2 + hand.sizes[FINGER_X], hand.sizes[FINGER_Y]
    low, high = np.array([-half_x, -half_y, -hand.sizes[FINGER_Z]]), np.array([half_x, half_y, 0.0])
    if len(hand.palm):
        low = np.minimum(low, (hand.palm[:, :3] - hand.palm[:, 3:]).min(axis=0))
        high = np.maximum(high, (hand.palm[:, :3] + hand.palm[:, 3:]).max(axis=0))
    low[2] -= hand.reach_m.max() - hand.reach_m.min()
    return np.stack([low - margin_m, high + margin_m])


@njit(cache=True)
def clear_of_support(
    R: np.ndarray,
    tip: np.ndarray,
    shift_z: float,
    sizes: np.ndarray,
    palm: np.ndarray,
    support_z_m: float,
    table_margin_m: float,
    tip_margin_m: float,
) -> bool:
    """Whether open gripper (drawn back by -shift_z) and closed fingertips keep their distance to the support."""
    side = abs(R[2, 1]) * sizes[FINGER_Y]
    outer = abs(R[2, 0]) * (0.5 * sizes[OPEN] + sizes[FINGER_X])
    if tip[2] - outer - side < support_z_m + tip_margin_m:
        return False
    back = tip[2] + (shift_z - sizes[FINGER_Z]) * R[2, 2]
    if back - outer - side < support_z_m + table_margin_m:
        return False
    for k in range(len(palm)):
        z = tip[2] + shift_z * R[2, 2]
        for a in range(3):
            z += palm[k, a] * R[2, a] - abs(R[2, a]) * palm[k, 3 + a]
        if z < support_z_m + table_margin_m:
            return False
    return True


@njit(cache=True)
def in_fingers(
    x: float,
    y: float,
    z: float,
    width_m: float,
    shift_z: float,
    back_m: float,
    margin_m: float,
    slack_m: float,
    sizes: np.ndarray,
    reach_m: np.ndarray,
) -> bool:
    """Whether a point (grasp frame) lies in what the fingers sweep from fully open to closed, grown by a margin.

    `slack_m`: points less than this outside the closed pads are not counted. `back_m`: how far the sweep is
    extended backwards beyond the open fingers.
    """
    if abs(y) > sizes[FINGER_Y] + margin_m or z > margin_m:
        return False
    distance = abs(x)
    if distance < 0.5 * width_m + slack_m or distance > 0.5 * sizes[OPEN] + sizes[FINGER_X] + margin_m:
        return False
    if z < shift_z - sizes[FINGER_Z] - back_m - margin_m:
        return False
    return z < sweep_end_z(distance - margin_m, width_m, shift_z, sizes, reach_m) + margin_m


@njit(cache=True)
def in_palm(x: float, y: float, z: float, shift_z: float, margin_m: float, palm_ranges: np.ndarray) -> bool:
    """Whether a point (grasp frame) lies in the open gripper's palm boxes, grown by a margin."""
    x, y, z = abs(x), abs(y), z - shift_z
    for k in range(len(palm_ranges)):
        if (
            x > palm_ranges[k, 0] - margin_m
            and x < palm_ranges[k, 1] + margin_m
            and y < palm_ranges[k, 2] + margin_m
            and z > palm_ranges[k, 3] - margin_m
            and z < palm_ranges[k, 4] + margin_m
        ):
            return True
    return False


@njit(cache=True)
def between_pads(x: float, y: float, z: float, half_x: float, sizes: np.ndarray) -> bool:
    """Whether a point (grasp frame) lies within |x| < half_x and within the pads along y and z."""
    return abs(x) < half_x and abs(y) < sizes[PAD_Y] and z <= 0.0 and z > -sizes[PAD_Z]
