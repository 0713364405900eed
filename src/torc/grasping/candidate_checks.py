"""Hard checks of candidates, on points: each against its own object's, then against all others'.

The gripper is checked at its largest opening, as it arrives, and while it closes. Contact with its own object decides
whether a candidate is kept at all; contact with *other* objects is only recorded, as evidence of who blocks whom.
Unknown space is never a veto.
"""

from collections import namedtuple
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int32, UInt8, UInt64
from numba import njit

from torc.grasping.cells import PointCells, gather
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
def _own_fault(local, index, seen, width, shift_z, hand, palm_top_z, limits):
    """Return the fault of one candidate from its own object's seen points, in the grasp frame."""
    in_finger, between = 0, 0
    for k in range(len(local)):
        if seen[index[k]] == 0:
            continue
        x, y, z = local[k, 0], local[k, 1], local[k, 2]
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
def _count_foreign(local, index, ids, own_id, width, shift_z, hand, palm_box, limits, foreign):
    """Count points of other objects (grasp frame) by place; return the bits of the objects in the way."""
    bits = np.uint64(0)
    half, outer = 0.5 * width, 0.5 * hand.max_width_m + hand.finger_x
    back, margin = shift_z - hand.finger_z, limits.finger_margin_m
    for k in range(len(local)):
        if ids[index[k]] == own_id:
            continue
        x, y, z = abs(local[k, 0]), abs(local[k, 1]), local[k, 2]
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
            foreign[place] += 1
            if place <= BETWEEN:
                bits |= np.uint64(1) << np.uint64(ids[index[k]])
    return bits


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


@njit(cache=True)
def _check_all(Rs, tips, widths, own, own_id, cells, hand, box, palm_box, support_z_m, limits):
    """Return fault, blockers and counts of other objects' points, per candidate.

    `box`: where points of other objects matter at all; `palm_box`: see `palm_bounds`.
    """
    total = len(widths)
    fault, blockers = np.zeros(total, np.uint8), np.zeros(total, np.uint64)
    foreign = np.zeros((total, 5), np.int32)
    local, index = np.empty((len(own.points), 3)), np.empty(len(own.points), dtype=np.int64)
    near, near_index = np.empty((len(cells.points), 3)), np.empty(len(cells.points), dtype=np.int64)
    own_box, ahead, box_behind = box.copy(), box.copy(), box.copy()
    own_box[1, 2] = 0.0
    ahead[1, 0] = 0.5 * hand.max_width_m + hand.finger_x + NEAR_M
    ahead[1, 1] = hand.finger_y + NEAR_M
    ahead[0, 0], ahead[0, 1] = -ahead[1, 0], -ahead[1, 1]
    for n in range(len(widths)):
        R, tip, width = Rs[n], tips[n], widths[n]
        shift_z = -reach_at(hand.reach_m, width)
        if not clear_of_support(
            R, tip, shift_z, hand, support_z_m, limits.table_margin_m, limits.tip_margin_m
        ):
            fault[n] = Fault.TABLE.value
            continue
        count = gather(R, tip, own_box, own, local, index)
        palm_top_z = palm_box[1, 2] + shift_z
        fault[n] = _own_fault(local[:count], index, own.tags, width, shift_z, hand, palm_top_z, limits)
        if fault[n] == 0:
            # Ahead of the palm only the fingers' surroundings matter, a much narrower box.
            ahead[0, 2] = box_behind[1, 2] = palm_top_z
            count = gather(R, tip, ahead, cells, near, near_index)
            count += gather(R, tip, box_behind, cells, near[count:], near_index[count:])
            blockers[n] = _count_foreign(
                near[:count],
                near_index,
                cells.tags,
                own_id,
                width,
                shift_z,
                hand,
                palm_box,
                limits,
                foreign[n],
            )
    return fault, blockers, foreign
