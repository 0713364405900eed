"""Describe the gripper by a few numbers, in the form that the kernels expect.

All lengths refer to the grasp frame of a grasp of width w: x closing, z approach, the closed fingertips at z = 0.
Fingertips may travel on an arc: opened, they are drawn back by `reach(w)` (0 for a gripper with straight travel).
"""

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.errors import InputError
from torc.robots.gripper import GripperDescription

REACH_STEP_M = 0.001
_SLENDER = 1.5
_LINK_PARTS = 3


class HandGeometry(NamedTuple):
    """A gripper, also for kernels. Metres.

    Attributes:
        max_width_m: largest opening.
        pad_y, pad_z: half width and height of a pad.
        finger_y, finger_x, finger_z: half width, thickness and length of a finger.
        palm: centre and half size of the boxes other than fingers, relative to the TCP of the *open* gripper.
        palm_ranges: these boxes for tests of points: least and greatest |x|, greatest |y|, least and greatest z. The
            gripper is assumed symmetric about both planes (else: as large as its larger half).
        reach_m: per millimetre of width, how far the fingertips lie ahead of those of the open gripper.
    """

    max_width_m: float
    pad_y: float
    pad_z: float
    finger_y: float
    finger_x: float
    finger_z: float
    palm: Float[np.ndarray, "k 6"]
    palm_ranges: Float[np.ndarray, "r 5"]
    reach_m: Float[np.ndarray, "m"]


@lru_cache(maxsize=16)
def hand_geometry(gripper: GripperDescription) -> HandGeometry:
    """Return the kernel form of a gripper. Raises InputError if its fingers do not enclose the TCP along x."""
    width = gripper.max_width_m
    left, right = sorted(gripper.finger_boxes(width), key=lambda b: b.center[0])
    lower = np.minimum(left.center - left.half_size, right.center - right.half_size)
    upper = np.maximum(left.center + left.half_size, right.center + right.half_size)
    if not (left.center[0] < 0 < right.center[0] and lower[2] < 0):
        raise InputError(
            f"Gripper '{gripper.name}': one finger must lie at -x, one at +x, both behind the TCP."
        )
    thickness = max(upper[0], -lower[0]) - width / 2
    half_y = max(upper[1], -lower[1])
    pieces = [part for b in gripper.palm_boxes(width) for part in _slender_parts(b.center, b.half_size)]
    palm = np.array(pieces).reshape(-1, 6)
    grid = np.arange(0.0, width + REACH_STEP_M, REACH_STEP_M)
    open_z = gripper.T_tool0_tcp(width)[2, 3]
    reach = gripper.Ts_tool0_tcp_at(np.minimum(grid, width))[:, 2, 3] - open_z
    return HandGeometry(
        max_width_m=float(width),
        pad_y=float(gripper.pad_width_m / 2),
        pad_z=float(gripper.pad_height_m),
        finger_y=float(half_y),
        finger_x=float(max(thickness, 1e-4)),
        finger_z=float(-lower[2]),
        palm=palm,
        palm_ranges=_ranges(palm),
        reach_m=reach,
    )


def _ranges(palm: Float[np.ndarray, "k 6"]) -> Float[np.ndarray, "r 5"]:
    """Return palm boxes as ranges of |x|, |y| and z, without duplicates."""
    center, half = np.abs(palm[:, :2]), palm[:, 3:5]
    low, high = np.maximum(center - half, 0.0), center + half
    z = np.stack([palm[:, 2] - palm[:, 5], palm[:, 2] + palm[:, 5]], axis=1)
    ranges = np.column_stack([low[:, 0], high[:, 0], high[:, 1], z])
    return ranges[np.sort(np.unique(np.round(ranges, 9), axis=0, return_index=True)[1])]


def _slender_parts(center: np.ndarray, half: np.ndarray) -> list[np.ndarray]:
    """Return boxes (centre, half size) that together hold what a bounding box of the open gripper holds.

    The links that carry the fingers lean outwards when the gripper is open. Their bounding box would fill the space
    between the fingers where tall objects go; a row of smaller boxes along its diagonal, as thick as the link is wide,
    does not. Boxes across the middle, or as slim as wide, are not links of this kind and stay.
    """
    x_inner, x_outer, radius = abs(center[0]) - half[0], abs(center[0]) + half[0], half[1]
    if x_inner <= 0 or half[0] < _SLENDER * radius or half[2] < _SLENDER * radius:
        return [np.concatenate([center, half])]
    start = np.array([x_inner + radius, center[2] - half[2] + radius])
    end = np.array([x_outer - radius, center[2] + half[2] - radius])
    steps = np.linspace(start, end, _LINK_PARTS + 1)
    out = []
    for a, b in pairwise(steps):
        (x, z), (hx, hz) = (a + b) / 2, np.abs(b - a) / 2 + radius
        out.append(np.array([np.sign(center[0]) * x, center[1], z, hx, radius, hz]))
    return out


@njit(cache=True)
def reach_at(reach_m, width_m):
    """Interpolate `HandGeometry.reach_m` linearly, constant outside."""
    s = width_m / 0.001
    if s <= 0.0:
        return reach_m[0]
    i = int(s)
    if i >= len(reach_m) - 1:
        return reach_m[-1]
    return reach_m[i] + (s - i) * (reach_m[i + 1] - reach_m[i])


@njit(cache=True)
def sweep_end_z(distance, width_m, shift_z, hand):
    """Return how far forward a closing finger comes at a distance |x| from the grasp's centre (grasp frame z).

    A finger covers |x| while half the opening lies in [|x| - thickness, |x|]; the smallest of these openings, but not
    below the grasp's width, comes furthest. `shift_z` = -reach_at(width).
    """
    return reach_at(hand.reach_m, max(width_m, 2.0 * (distance - hand.finger_x))) + shift_z


def hand_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Return the lower and upper corner, in the grasp frame, of a box that holds the gripper at any opening."""
    half_x, half_y = hand.max_width_m / 2 + hand.finger_x, hand.finger_y
    low, high = np.array([-half_x, -half_y, -hand.finger_z]), np.array([half_x, half_y, 0.0])
    if len(hand.palm):
        low = np.minimum(low, (hand.palm[:, :3] - hand.palm[:, 3:]).min(axis=0))
        high = np.maximum(high, (hand.palm[:, :3] + hand.palm[:, 3:]).max(axis=0))
    low[2] -= hand.reach_m.max() - hand.reach_m.min()
    return np.stack([low - margin_m, high + margin_m])


@njit(cache=True)
def clear_of_support(R, tip, shift_z, hand, support_z_m, table_margin_m, tip_margin_m):
    """Check whether open gripper (drawn back by -shift_z) and closed fingertips keep their distance to the support."""
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
    """Check whether a point (grasp frame) lies in the fingers' sweep from fully open to closed, grown by a margin.

    `slack_m`: points less than this outside the closed pads do not count. `back_m`: how far the sweep extends backwards
    beyond the open fingers.
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
    """Check whether a point (grasp frame) lies in the open gripper's palm boxes, grown by a margin."""
    x, y, z = abs(x), abs(y), z - shift_z
    for k in range(len(hand.palm_ranges)):
        x_low, x_high, y_high, z_low, z_high = hand.palm_ranges[k]
        beside = x_low - margin_m < x < x_high + margin_m and y < y_high + margin_m
        if beside and z_low - margin_m < z < z_high + margin_m:
            return True
    return False


@njit(cache=True)
def between_pads(x, y, z, half_x, pad_y, pad_z):
    """Check whether a point (grasp frame) lies within |x| < half_x and within the pads along y and z.

    Without a HandGeometry: counting references to its arrays would take longer than the check.
    """
    return abs(x) < half_x and abs(y) < pad_y and z <= 0.0 and z > -pad_z
