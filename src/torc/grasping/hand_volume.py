"""Where a point, or the table, is relative to the gripper: in the fingers' sweep, in the palm, between the pads.

Points are given in the grasp frame; `shift_z` = -reach_at(width) is how far the open gripper is drawn back from the
closed one.
"""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.grasping.hand import HandGeometry, sweep_end_z


def hand_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Lower and upper corner, in the grasp frame, of a box that holds the gripper at any opening."""
    half_x, half_y = hand.max_width_m / 2 + hand.finger_x, hand.finger_y
    low, high = np.array([-half_x, -half_y, -hand.finger_z]), np.array([half_x, half_y, 0.0])
    if len(hand.palm):
        low = np.minimum(low, (hand.palm[:, :3] - hand.palm[:, 3:]).min(axis=0))
        high = np.maximum(high, (hand.palm[:, :3] + hand.palm[:, 3:]).max(axis=0))
    low[2] -= hand.reach_m.max() - hand.reach_m.min()
    return np.stack([low - margin_m, high + margin_m])


@njit(cache=True)
def clear_of_support(R, tip, shift_z, hand, support_z_m, table_margin_m, tip_margin_m):
    """Whether open gripper (drawn back by -shift_z) and closed fingertips keep their distance to the support."""
    side = abs(R[2, 1]) * hand.finger_y
    outer = abs(R[2, 0]) * (0.5 * hand.max_width_m + hand.finger_x)
    if tip[2] - outer - side < support_z_m + tip_margin_m:
        return False
    back = tip[2] + (shift_z - hand.finger_z) * R[2, 2]
    if back - outer - side < support_z_m + table_margin_m:
        return False
    for k in range(len(hand.palm)):
        z = tip[2] + shift_z * R[2, 2]
        for a in range(3):
            z += hand.palm[k, a] * R[2, a] - abs(R[2, a]) * hand.palm[k, 3 + a]
        if z < support_z_m + table_margin_m:
            return False
    return True


@njit(cache=True)
def in_fingers(x, y, z, width_m, shift_z, back_m, margin_m, slack_m, hand):
    """Whether a point (grasp frame) lies in what the fingers sweep from fully open to closed, grown by a margin.

    `slack_m`: points less than this outside the closed pads are not counted. `back_m`: how far the sweep is
    extended backwards beyond the open fingers.
    """
    if abs(y) > hand.finger_y + margin_m or z > margin_m:
        return False
    distance = abs(x)
    if distance < 0.5 * width_m + slack_m or distance > 0.5 * hand.max_width_m + hand.finger_x + margin_m:
        return False
    if z < shift_z - hand.finger_z - back_m - margin_m:
        return False
    return z < sweep_end_z(distance - margin_m, width_m, shift_z, hand) + margin_m


@njit(cache=True)
def in_palm(x, y, z, shift_z, margin_m, hand):
    """Whether a point (grasp frame) lies in the open gripper's palm boxes, grown by a margin."""
    x, y, z = abs(x), abs(y), z - shift_z
    for k in range(len(hand.palm_ranges)):
        x_low, x_high, y_high, z_low, z_high = hand.palm_ranges[k]
        beside = x_low - margin_m < x < x_high + margin_m and y < y_high + margin_m
        if beside and z_low - margin_m < z < z_high + margin_m:
            return True
    return False


@njit(cache=True)
def between_pads(x, y, z, half_x, hand):
    """Whether a point (grasp frame) lies within |x| < half_x and within the pads along y and z."""
    return abs(x) < half_x and abs(y) < hand.pad_y and z <= 0.0 and z > -hand.pad_z
