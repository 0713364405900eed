"""Hard checks of candidates, on points: each against its own object's, then against all others'.

The gripper is checked at its largest opening, as it arrives, and while it closes. Contact with its own object decides
whether a candidate is kept at all; contact with *other* objects is only recorded, as evidence of who blocks whom.
Unknown space is never a veto.
"""

from collections import namedtuple
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Int32, UInt8, UInt64
from numba import njit

from torc.grasping.cells import PointCells, along, find_reached, frame_of
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
    limits = _Limits(**vars(config))
    fault, blockers, foreign = _check_all(
        raw.Rs, raw.tips, raw.widths_m, cloud.cells, cloud.id, cells, hand, box, support_z_m, limits
    )
    touching = foreign[:, FINGERS] + foreign[:, PALM] > config.max_foreign_touching
    blocked = touching | (foreign[:, BETWEEN] > config.max_foreign_between)
    return CheckResult(fault, blockers, foreign, blocked)


@njit(cache=True)
def _regions(hand, near_m, slack_m, margin_m):
    """Return where the open gripper's parts are: half widths of its slim part, then half widths and top of the rest.

    The slim part, grown by `near_m`, is about as thick as the fingers, and holds the space between the pads with
    `slack_m` beside it; the rest, grown by `margin_m`, lies behind it.
    """
    slim_x = 0.5 * hand.max_width_m + max(hand.finger_x + near_m, slack_m)
    slim_y = max(hand.finger_y, hand.pad_y) + near_m
    wide_x, wide_y, wide_z = 0.0, 0.0, -1e9
    for k in range(len(hand.palm_ranges)):
        part = hand.palm_ranges[k]
        x, y, z = part[1] + margin_m, part[2] + margin_m, part[4] + margin_m
        if y <= hand.finger_y + NEAR_M:
            slim_x, slim_y = max(slim_x, x), max(slim_y, y)
        else:
            wide_x, wide_y, wide_z = max(wide_x, x), max(wide_y, y), max(wide_z, z)
    return (slim_x, slim_y), (wide_x, wide_y, wide_z)


@njit(cache=True)
def _own_fault(frame, regions, bottom, own, reached, width, shift_z, palm_top_z, hand, limits):
    """Return the fault of one candidate from its own object's seen points; none above `palm_top_z` is in the palm."""
    (slim, wide), (ex, ey, ez, origin) = regions, frame
    wide = (wide[0], wide[1], wide[2] + shift_z)
    half, pad_y, pad_z = 0.5 * width + limits.own_slack_m, hand.pad_y, hand.pad_z
    in_finger, between = 0, 0
    find_reached(frame, slim, wide, bottom, 0.0, own.centers, own.radii, reached)
    for c in range(len(reached)):
        if not reached[c]:
            continue
        for i in range(own.starts[c], own.starts[c + 1]):
            if own.tags[i] == 0:
                continue
            px, py, pz = (
                own.points[i, 0] - origin[0],
                own.points[i, 1] - origin[1],
                own.points[i, 2] - origin[2],
            )
            y, z = abs(along(ey, px, py, pz)), along(ez, px, py, pz)
            if z < bottom or z > 0.0 or (y > slim[1] and (y > wide[1] or z > wide[2])):
                continue
            x = abs(along(ex, px, py, pz))
            if in_fingers(x, y, z, width, shift_z, limits.approach_m, 0.0, limits.own_slack_m, hand):
                in_finger += 1
                if in_finger > limits.max_own_in_fingers:
                    return Fault.OWN_IN_FINGERS.value
            if z <= palm_top_z and in_palm(x, y, z, shift_z, limits.palm_margin_m, hand):
                return Fault.OWN_IN_PALM.value
            if between_pads(x, y, z, half, pad_y, pad_z):
                between += 1
    return Fault.TOO_FEW_POINTS.value if between < limits.min_points_between else Fault.NONE.value


@njit(cache=True)
def _count_foreign(frame, regions, bottom, top, others, width, shift_z, hand, limits):
    """Return the bits of the objects in the way, and how many of their points are in each place."""
    (slim, wide), (ex, ey, ez, origin) = regions, frame
    wide = (wide[0], wide[1], wide[2] + shift_z)
    bits, counts = np.uint64(0), np.zeros(5, np.int32)
    half, outer = 0.5 * width, 0.5 * hand.max_width_m + hand.finger_x
    back, margin = shift_z - hand.finger_z, limits.finger_margin_m
    points, tags, starts, centers, radii, reached = others
    find_reached(frame, slim, wide, bottom, top, centers, radii, reached)
    for c in range(len(reached)):
        if not reached[c]:
            continue
        for i in range(starts[c], starts[c + 1]):
            px, py, pz = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
            y, z = abs(along(ey, px, py, pz)), along(ez, px, py, pz)
            if z < bottom or z > top or (y > slim[1] and (y > wide[1] or z > wide[2])):
                continue
            x = abs(along(ex, px, py, pz))
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
                at = _palm_place(x, y, z - shift_z, hand.palm_ranges, limits.palm_margin_m)
                if at == PALM or place < 0:
                    place = at
            if place >= 0:
                counts[place] += 1
                if place <= BETWEEN:
                    bits |= np.uint64(1) << np.uint64(tags[i])
    return bits, counts


@njit(cache=True)
def _palm_place(x, y, z, palm_ranges, margin_m):
    """Return PALM, CORRIDOR or -1 for a point (|x|, |y|, z) in the frame of the open gripper's TCP."""
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
def _others_near(tips, cells, own_id, reach):
    """Return other objects' points in cells that come within `reach` of some tip, or nearly so.

    Points, ids, first point of each cell, spheres around the cells, and scratch memory for `find_reached`.
    """
    low, high = np.full(3, 1e9), np.full(3, -1e9)
    for n in range(len(tips)):
        for a in range(3):
            low[a], high[a] = min(low[a], tips[n, a]), max(high[a], tips[n, a])
    kept, near = np.empty(len(cells.points), np.int64), np.empty(len(cells.radii), np.int64)
    starts, count, found = np.zeros(len(cells.radii) + 1, np.int64), 0, 0
    for c in range(len(cells.radii)):
        distance2 = 0.0
        for a in range(3):
            p = cells.centers[a, c]
            distance2 += max(low[a] - p, p - high[a], 0.0) ** 2
        if distance2 > (reach + cells.radii[c]) ** 2:
            continue
        for i in range(cells.starts[c], cells.starts[c + 1]):
            if cells.tags[i] != own_id:
                kept[count] = i
                count += 1
        if count > starts[found]:
            near[found] = c
            found += 1
            starts[found] = count
    kept, near, centers = kept[:count], near[:found], np.empty((3, found))
    for a in range(3):
        centers[a] = cells.centers[a][near]
    return cells.points[kept], cells.tags[kept], starts, centers, cells.radii[near], np.empty(found, np.bool_)


@njit(cache=True, nogil=True)
def _check_all(Rs, tips, widths, own, own_id, cells, hand, box, support_z_m, limits):
    """Return fault, blockers and counts of other objects' points, per candidate.

    `box`: where points of other objects matter at all.
    """
    total = len(widths)
    fault, blockers = np.zeros(total, np.uint8), np.zeros(total, np.uint64)
    foreign = np.zeros((total, 5), np.int32)
    reach = 0.0
    for a in range(3):
        reach += max(abs(box[0, a]), abs(box[1, a])) ** 2
    others = _others_near(tips, cells, own_id, np.sqrt(reach))
    reached = np.empty(len(own.radii), np.bool_)
    palm_top_z = -1e9
    for part in range(len(hand.palm_ranges)):
        palm_top_z = max(palm_top_z, hand.palm_ranges[part, 4] + limits.palm_margin_m)
    own_regions = _regions(hand, 0.0, limits.own_slack_m, limits.palm_margin_m)
    other_regions = _regions(hand, NEAR_M, 0.0, limits.palm_margin_m)
    bottom, top = box[0, 2], box[1, 2]
    for n in range(len(widths)):
        R, tip, width = Rs[n], tips[n], widths[n]
        shift_z = -reach_at(hand.reach_m, width)
        if not clear_of_support(
            R, tip, shift_z, hand, support_z_m, limits.table_margin_m, limits.tip_margin_m
        ):
            fault[n] = Fault.TABLE.value
            continue
        frame = frame_of(R, tip)
        fault[n] = _own_fault(
            frame, own_regions, bottom, own, reached, width, shift_z, palm_top_z + shift_z, hand, limits
        )
        if fault[n] == 0:
            blockers[n], foreign[n] = _count_foreign(
                frame, other_regions, bottom, top, others, width, shift_z, hand, limits
            )
    return fault, blockers, foreign
