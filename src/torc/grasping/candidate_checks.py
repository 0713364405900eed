"""Hard checks of candidates, on points: each against its own object's, then against all others'.

The gripper is checked at its largest opening, as it arrives, and while it closes. Contact with its own object decides
whether a candidate is kept at all; contact with *other* objects is only recorded, as evidence of who blocks whom.
Unknown space is never a veto.
"""

from collections import namedtuple
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int32, UInt8, UInt64
from numba import njit

from torc.grasping.cells import PointCells, along, box_reached, frame_of
from torc.grasping.clouds import ObjectCloud
from torc.grasping.config import CheckConfig
from torc.grasping.generators.common import RawCandidates
from torc.grasping.hand import (
    HandGeometry,
    between_pads,
    clear_of_support,
    hand_bounds,
    in_fingers,
    in_palm,
    reach_at,
    sweep_end_z,
)


class Fault(IntEnum):
    """The first check against its own object or the table that a candidate fails."""

    NONE = 0
    TABLE = 1
    """Part of the gripper is too close to the support, or below it."""
    OWN_IN_FINGERS = 2
    """Points of the object where a finger goes: on the straight approach or while closing."""
    OWN_IN_PALM = 3
    """Points of the object inside the rest of the gripper."""
    TOO_FEW_POINTS = 4
    """Too few seen points of the object are between the pads."""


FINGERS, PALM, BETWEEN, NEAR, CORRIDOR = range(5)
"""Places of other objects' points: in the fingers' sweep, in the palm, between the pads, within NEAR_M of the fingers'
sweep, in what the gripper passes on the last CORRIDOR_M of its approach. Each point counts once.
"""
NEAR_M = 0.012
CORRIDOR_M = 0.10


@dataclass(frozen=True)
class CheckResult:
    """The result of the checks.

    Attributes:
        fault: a Fault per candidate.
        blockers: other objects that the gripper touches or has between its pads, bit k for object id k.
        foreign: points of other objects, columns FINGERS .. CORRIDOR; 0 for candidates with a fault, which are not
            checked further.
        blocked: whether each candidate touches other objects or would grip them.
    """

    fault: UInt8[np.ndarray, "n"]
    blockers: UInt64[np.ndarray, "n"]
    foreign: Int32[np.ndarray, "n 5"]
    blocked: Bool[np.ndarray, "n"]


_Limits = namedtuple("_Limits", [f.name for f in fields(CheckConfig)])  # type: ignore[misc]
"""A CheckConfig for kernels."""


def check_candidates(
    raw: RawCandidates,
    cloud: ObjectCloud,
    cells: PointCells,
    hand: HandGeometry,
    support_z_m: float,
    config: CheckConfig,
) -> CheckResult:
    """Check the candidates of one object against its seen points and all `cells`."""
    box = hand_bounds(hand, max(NEAR_M, config.finger_margin_m, config.palm_margin_m))
    box[0, 2] -= CORRIDOR_M
    palm_box = palm_bounds(hand, config.palm_margin_m)
    limits = _Limits(**vars(config))
    fault, blockers, foreign = _check_all(
        raw.Rs, raw.tips, raw.widths_m, cloud.cells, cloud.id, cells, hand, box, palm_box, support_z_m, limits
    )
    touching = foreign[:, FINGERS] + foreign[:, PALM] > config.max_foreign_touching
    blocked = touching | (foreign[:, BETWEEN] > config.max_foreign_between)
    return CheckResult(fault, blockers, foreign, blocked)


def palm_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Return largest |x|, |y| and z of the palm boxes, in the second row; relative to the open gripper's TCP."""
    if len(hand.palm) == 0:
        return np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    upper = (np.abs(hand.palm[:, :3]) + hand.palm[:, 3:]).max(axis=0)
    upper[2] = (hand.palm[:, 2] + hand.palm[:, 5]).max()
    return np.stack([-upper, upper + margin_m])


@njit(cache=True)
def _own_fault(frame, box, own, width, shift_z, hand, palm_top_z, limits):
    """Return the fault of one candidate from its own object's seen points in a box of the grasp frame."""
    ex, ey, ez, origin = frame
    # Ahead of the palm only what the fingers pass matters.
    ahead = (box[0], -hand.finger_y, palm_top_z, box[3], hand.finger_y, box[5])
    behind = (box[0], box[1], box[2], box[3], box[4], palm_top_z)
    in_finger, between = 0, 0
    for c in range(len(own.radii)):
        center, radius = own.centers[c], own.radii[c]
        if not box_reached(frame, center, radius, ahead) and not box_reached(frame, center, radius, behind):
            continue
        for i in range(own.starts[c], own.starts[c + 1]):
            if own.tags[i] == 0:
                continue
            px, py, pz = own.points[i, 0] - origin[0], own.points[i, 1] - origin[1], own.points[i, 2] - origin[2]
            y = along(ey, px, py, pz)
            if y < box[1] or y > box[4]:
                continue
            z = along(ez, px, py, pz)
            if z < box[2] or z > box[5] or (z > palm_top_z and abs(y) > hand.finger_y):
                continue
            x = along(ex, px, py, pz)
            if x < box[0] or x > box[3]:
                continue
            if in_fingers(x, y, z, width, shift_z, limits.approach_m, 0.0, limits.own_slack_m, hand):
                in_finger += 1
                if in_finger > limits.max_own_in_fingers:
                    return Fault.OWN_IN_FINGERS.value
            if z <= palm_top_z and in_palm(x, y, z, shift_z, limits.palm_margin_m, hand):
                return Fault.OWN_IN_PALM.value
            if between_pads(x, y, z, 0.5 * width + limits.own_slack_m, hand):
                between += 1
    return Fault.TOO_FEW_POINTS.value if between < limits.min_points_between else Fault.NONE.value


@njit(cache=True)
def _count_foreign(frame, ahead, behind, near, hit, cells, own_id, width, shift_z, hand, palm_box, limits):
    """Return the bits of the objects in the way, and how many points of other objects are in each place.

    Only points in one of two boxes of the grasp frame, `ahead` of the palm and `behind`, in the cells `near`; `hit` is
    scratch memory for them.
    """
    ex, ey, ez, origin = frame
    bits = np.uint64(0)
    in_fingers_, in_palm_, between, close, corridor = 0, 0, 0, 0, 0
    half, outer = 0.5 * width, 0.5 * hand.max_width_m + hand.finger_x
    back, margin = shift_z - hand.finger_z, limits.finger_margin_m
    _find_reached(frame, ahead, behind, near, hit)
    for m in range(len(hit)):
        if not hit[m]:
            continue
        c = near.index[m]
        for i in range(cells.starts[c], cells.starts[c + 1]):
            if cells.tags[i] == own_id:
                continue
            px, py, pz = cells.points[i, 0] - origin[0], cells.points[i, 1] - origin[1], cells.points[i, 2] - origin[2]
            y = abs(along(ey, px, py, pz))
            if y > behind[4]:
                continue
            z = along(ez, px, py, pz)
            if z < behind[2] or z > ahead[5]:
                continue
            x = abs(along(ex, px, py, pz))
            if x > behind[3] or (z > behind[5] and (x > ahead[3] or y > ahead[4])):
                continue
            place = -1
            if x < half:
                if y < hand.pad_y and z <= 0.0 and z > -hand.pad_z:
                    place = BETWEEN
            elif x < outer + NEAR_M and y < hand.finger_y + NEAR_M:
                end = sweep_end_z(x - margin, width, shift_z, hand)
                if x < outer + margin and y < hand.finger_y + margin and z < end + margin:
                    if z > back - margin:
                        place = FINGERS
                    elif z > back - CORRIDOR_M:
                        place = CORRIDOR
                if place != FINGERS and z < end + NEAR_M and z > back - NEAR_M:
                    place = NEAR
            if place < 0 or place > BETWEEN:
                at = _palm_place(x, y, z - shift_z, hand.palm_ranges, palm_box, limits.palm_margin_m)
                if at == PALM or place < 0:
                    place = at
            if place >= 0:
                in_fingers_ += place == FINGERS
                in_palm_ += place == PALM
                between += place == BETWEEN
                close += place == NEAR
                corridor += place == CORRIDOR
                if place <= BETWEEN:
                    bits |= np.uint64(1) << np.uint64(cells.tags[i])
    return bits, (in_fingers_, in_palm_, between, close, corridor)


class _Spheres(NamedTuple):
    """Cells, and the spheres around them, coordinate by coordinate: their tests become vector instructions."""

    index: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    r: np.ndarray


@njit(cache=True)
def _find_reached(frame, ahead, behind, near, hit):
    """Write which spheres come near one of two boxes, of which `behind` is at least as wide as `ahead`."""
    ex, ey, ez, origin = frame
    for m in range(len(hit)):
        px, py, pz, r = near.x[m] - origin[0], near.y[m] - origin[1], near.z[m] - origin[2], near.r[m]
        x, y, z = abs(along(ex, px, py, pz)) - r, abs(along(ey, px, py, pz)) - r, along(ez, px, py, pz)
        hit[m] = (
            (x <= behind[3])
            & (y <= behind[4])
            & (z >= behind[2] - r)
            & (z <= ahead[5] + r)
            & ((z <= behind[5] + r) | ((x <= ahead[3]) & (y <= ahead[4])))
        )


@njit(cache=True)
def _cells_near(tips, cells, own_id, reach):
    """Return the cells with points of other objects that come within `reach` of some tip, or nearly so."""
    near, count = np.empty(len(cells.radii), np.int64), 0
    low, high = np.full(3, 1e9), np.full(3, -1e9)
    for n in range(len(tips)):
        for a in range(3):
            low[a], high[a] = min(low[a], tips[n, a]), max(high[a], tips[n, a])
    for c in range(len(cells.radii)):
        distance2 = 0.0
        for a in range(3):
            p = cells.centers[c, a]
            distance2 += max(low[a] - p, p - high[a], 0.0) ** 2
        if distance2 > (reach + cells.radii[c]) ** 2:
            continue
        for i in range(cells.starts[c], cells.starts[c + 1]):
            if cells.tags[i] != own_id:
                near[count] = c
                count += 1
                break
    near = near[:count]
    x, y, z = cells.centers[near, 0], cells.centers[near, 1], cells.centers[near, 2]
    return _Spheres(near, x, y, z, cells.radii[near])


@njit(cache=True)
def _palm_place(x, y, z, palm_ranges, palm_box, margin_m):
    """Return PALM, CORRIDOR or -1 for a point (|x|, |y|, z) in the frame of the open gripper's TCP."""
    if z > palm_box[1, 2] or y > palm_box[1, 1] or x > palm_box[1, 0]:
        return -1
    place = -1
    x, y = x - margin_m, y - margin_m
    for k in range(len(palm_ranges)):
        if x >= palm_ranges[k, 1] or y >= palm_ranges[k, 2] or x <= palm_ranges[k, 0] - 2.0 * margin_m:
            continue
        if z < palm_ranges[k, 4] + margin_m:
            if z > palm_ranges[k, 3] - margin_m:
                return PALM
            if z > palm_ranges[k, 3] - margin_m - CORRIDOR_M:
                place = CORRIDOR
    return place


@njit(cache=True, nogil=True)
def _check_all(Rs, tips, widths, own, own_id, cells, hand, box, palm_box, support_z_m, limits):
    """Return fault, blockers and counts of other objects' points, per candidate.

    `box`: where points of other objects matter at all; `palm_box`: see `palm_bounds`.
    """
    total = len(widths)
    fault, blockers = np.zeros(total, np.uint8), np.zeros(total, np.uint64)
    foreign = np.zeros((total, 5), np.int32)
    reach = 0.0
    for a in range(3):
        reach += max(abs(box[0, a]), abs(box[1, a])) ** 2
    near = _cells_near(tips, cells, own_id, np.sqrt(reach))
    hit = np.empty(len(near.index), np.bool_)
    own_box = (box[0, 0], box[0, 1], box[0, 2], box[1, 0], box[1, 1], 0.0)
    side_x, side_y = 0.5 * hand.max_width_m + hand.finger_x + NEAR_M, hand.finger_y + NEAR_M
    for n in range(len(widths)):
        R, tip, width = Rs[n], tips[n], widths[n]
        shift_z = -reach_at(hand.reach_m, width)
        if not clear_of_support(
            R, tip, shift_z, hand, support_z_m, limits.table_margin_m, limits.tip_margin_m
        ):
            fault[n] = Fault.TABLE.value
            continue
        frame = frame_of(R, tip)
        palm_top_z = palm_box[1, 2] + shift_z
        fault[n] = _own_fault(frame, own_box, own, width, shift_z, hand, palm_top_z, limits)
        if fault[n] == 0:
            # Ahead of the palm only the fingers' surroundings matter, a much narrower box.
            ahead = (-side_x, -side_y, palm_top_z, side_x, side_y, box[1, 2])
            behind = (box[0, 0], box[0, 1], box[0, 2], box[1, 0], box[1, 1], palm_top_z)
            blockers[n], counts = _count_foreign(
                frame, ahead, behind, near, hit, cells, own_id, width, shift_z, hand, palm_box, limits
            )
            for k in range(5):
                foreign[n, k] = counts[k]
    return fault, blockers, foreign
