"""Hard checks of candidates, on points.

The gripper is taken at its largest opening, as it arrives, and while it closes. What a candidate does to its own
object decides whether it is kept at all; what it does to *other* objects is only recorded: such grasps are
evidence of who blocks whom. Unknown space is never a veto.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int32, UInt8, UInt64
from numba import njit

from torc.grasping.cells import PointCells, box_reached, gather
from torc.grasping.config import CheckConfig
from torc.grasping.hand import HandGeometry, reach_at, sweep_end_z


class Fault(IntEnum):
    """The first check on its own object or the table that a candidate fails."""

    NONE = 0
    TABLE = 1
    """Part of the gripper is too close to the support, or below it."""
    OWN_IN_FINGERS = 2
    """Points of the object where a finger goes: on the straight approach or while closing."""
    OWN_IN_PALM = 3
    """Points of the object inside the rest of the gripper."""
    TOO_FEW_POINTS = 4
    """Too few seen points of the object between the pads."""


FINGERS, PALM, BETWEEN, NEAR, CORRIDOR = range(5)
"""Where points of other objects are: in the fingers' sweep, in the palm, between the pads, within NEAR_M of the
fingers' sweep, in what the gripper passes on the last CORRIDOR_M of its approach. Each point counts once."""
NEAR_M = 0.012
CORRIDOR_M = 0.10


@dataclass(frozen=True)
class CheckResult:
    """What the checks found.

    Attributes:
        fault: a Fault per candidate.
        blockers: other objects that the gripper touches or has between its pads, bit k for object id k.
        foreign: points of other objects, columns FINGERS .. CORRIDOR; 0 for candidates with a fault, which are
            not looked at further.
    """

    fault: UInt8[np.ndarray, "n"]
    blockers: UInt64[np.ndarray, "n"]
    foreign: Int32[np.ndarray, "n 5"]

    def blocked(self, config: CheckConfig) -> np.ndarray:
        """Whether each candidate touches other objects or would take hold of them."""
        touching = self.foreign[:, FINGERS] + self.foreign[:, PALM] > config.max_foreign_touching
        return touching | (self.foreign[:, BETWEEN] > config.max_foreign_between)


def check_candidates(
    Rs: Float[np.ndarray, "n 3 3"],
    tips: Float[np.ndarray, "n 3"],
    widths_m: Float[np.ndarray, "n"],
    own: PointCells,
    own_id: int,
    cells: PointCells,
    hand: HandGeometry,
    support_z_m: float,
    config: CheckConfig,
) -> CheckResult:
    """Check the candidates of one object. Its points `own` are tagged 1 where they were seen;
    only those count."""
    n = len(widths_m)
    result = CheckResult(np.zeros(n, np.uint8), np.zeros(n, np.uint64), np.zeros((n, 5), np.int32))
    margins = np.array(
        [
            config.finger_margin_m,
            config.palm_margin_m,
            config.own_slack_m,
            config.table_margin_m,
            config.tip_margin_m,
            config.approach_m,
        ]
    )
    limits = np.array([config.max_own_in_fingers, config.min_points_between], dtype=np.int64)
    box = hand_bounds(hand, max(NEAR_M, config.finger_margin_m, config.palm_margin_m))
    box[0, 2] -= CORRIDOR_M
    _check(
        Rs,
        tips,
        widths_m,
        own.points,
        own.tags,
        own.starts,
        own.centers,
        own.radii,
        own_id,
        cells.points,
        cells.tags,
        cells.starts,
        cells.centers,
        cells.radii,
        hand.sizes,
        hand.palm,
        hand.reach_m,
        box,
        support_z_m,
        margins,
        limits,
        result.fault,
        result.blockers,
        result.foreign,
    )
    return result


def hand_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Lower and upper corner, in the grasp frame, of a box that holds the gripper at any opening."""
    half_x, half_y = hand.sizes[0] / 2 + hand.sizes[4], hand.sizes[3]
    low, high = np.array([-half_x, -half_y, -hand.sizes[5]]), np.array([half_x, half_y, 0.0])
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
    side = abs(R[2, 1]) * sizes[3]
    outer = abs(R[2, 0]) * (0.5 * sizes[0] + sizes[4])
    if tip[2] - outer - side < support_z_m + tip_margin_m:
        return False
    back = tip[2] + (shift_z - sizes[5]) * R[2, 2]
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
    if abs(y) > sizes[3] + margin_m or z > margin_m:
        return False
    distance = abs(x)
    if distance < 0.5 * width_m + slack_m or distance > 0.5 * sizes[0] + sizes[4] + margin_m:
        return False
    if z < shift_z - sizes[5] - back_m - margin_m:
        return False
    return z < sweep_end_z(max(distance - margin_m, 0.0), width_m, sizes, reach_m) + margin_m


@njit(cache=True)
def in_palm(x: float, y: float, z: float, shift_z: float, margin_m: float, palm: np.ndarray) -> bool:
    """Whether a point (grasp frame) lies in the open gripper's palm boxes, grown by a margin."""
    for k in range(len(palm)):
        if (
            abs(x - palm[k, 0]) < palm[k, 3] + margin_m
            and abs(y - palm[k, 1]) < palm[k, 4] + margin_m
            and abs(z - shift_z - palm[k, 2]) < palm[k, 5] + margin_m
        ):
            return True
    return False


@njit(cache=True)
def between_pads(x: float, y: float, z: float, half_x: float, sizes: np.ndarray) -> bool:
    """Whether a point (grasp frame) lies within |x| < half_x and within the pads along y and z."""
    return abs(x) < half_x and abs(y) < sizes[1] and z <= 0.0 and z > -sizes[2]


@njit(cache=True)
def _own_fault(
    local: np.ndarray,
    index: np.ndarray,
    count: int,
    seen: np.ndarray,
    width: float,
    shift_z: float,
    sizes: np.ndarray,
    palm: np.ndarray,
    reach_m: np.ndarray,
    margins: np.ndarray,
    limits: np.ndarray,
) -> int:
    """Fault of one candidate as to its own object's seen points, given in the grasp frame."""
    in_finger, between = 0, 0
    for k in range(count):
        if seen[index[k]] == 0:
            continue
        x, y, z = local[k, 0], local[k, 1], local[k, 2]
        if in_fingers(x, y, z, width, shift_z, margins[5], 0.0, margins[2], sizes, reach_m):
            in_finger += 1
            if in_finger > limits[0]:
                return Fault.OWN_IN_FINGERS.value
        if in_palm(x, y, z, shift_z, margins[1], palm):
            return Fault.OWN_IN_PALM.value
        if between_pads(x, y, z, 0.5 * width + margins[2], sizes):
            between += 1
    return Fault.TOO_FEW_POINTS.value if between < limits[1] else Fault.NONE.value


@njit(cache=True)
def _where(
    x: float,
    y: float,
    z: float,
    width_m: float,
    shift_z: float,
    sizes: np.ndarray,
    palm: np.ndarray,
    reach_m: np.ndarray,
    finger_margin_m: float,
    palm_margin_m: float,
) -> int:
    """Column of CheckResult.foreign that a point (grasp frame) counts in; -1: none."""
    distance, side = abs(x), abs(y)
    outside = distance - 0.5 * sizes[0] - sizes[4]
    corridor = False
    if distance < 0.5 * width_m:
        if side < sizes[1] and z <= 0.0 and z > -sizes[2]:
            return BETWEEN
    elif outside < NEAR_M and side < sizes[3] + NEAR_M:
        end = sweep_end_z(max(distance - finger_margin_m, 0.0), width_m, sizes, reach_m)
        back = shift_z - sizes[5]
        if z < end + NEAR_M:
            in_column = outside < finger_margin_m and side < sizes[3] + finger_margin_m
            if in_column and z < end + finger_margin_m:
                if z > back - finger_margin_m:
                    return FINGERS
                corridor = z > back - CORRIDOR_M
            if z > back - NEAR_M:
                return PALM if in_palm(x, y, z, shift_z, palm_margin_m, palm) else NEAR
    for k in range(len(palm)):
        if abs(x - palm[k, 0]) < palm[k, 3] + palm_margin_m and abs(y - palm[k, 1]) < palm[k, 4] + palm_margin_m:
            gap = palm[k, 2] + palm[k, 5] + palm_margin_m - (z - shift_z)
            if gap > 0.0:
                depth = 2.0 * (palm[k, 5] + palm_margin_m)
                if gap < depth:
                    return PALM
                corridor = corridor or gap < depth + CORRIDOR_M
    return CORRIDOR if corridor else -1


@njit(cache=True)
def _foreign(
    R: np.ndarray,
    tip: np.ndarray,
    width: float,
    shift_z: float,
    own_id: int,
    points: np.ndarray,
    ids: np.ndarray,
    starts: np.ndarray,
    centers: np.ndarray,
    radii: np.ndarray,
    sizes: np.ndarray,
    palm: np.ndarray,
    reach_m: np.ndarray,
    box: np.ndarray,
    margins: np.ndarray,
    foreign: np.ndarray,
) -> np.uint64:
    """Count points of other objects in and about the gripper; returns the bits of those that are in the way."""
    bits = np.uint64(0)
    for c in range(len(radii)):
        if not box_reached(R, tip, centers[c], radii[c], box):
            continue
        for i in range(starts[c], starts[c + 1]):
            if ids[i] == own_id:
                continue
            px, py, pz = points[i, 0] - tip[0], points[i, 1] - tip[1], points[i, 2] - tip[2]
            z = R[0, 2] * px + R[1, 2] * py + R[2, 2] * pz
            y = R[0, 1] * px + R[1, 1] * py + R[2, 1] * pz
            if z > box[1, 2] or y < box[0, 1] or y > box[1, 1]:
                continue
            x = R[0, 0] * px + R[1, 0] * py + R[2, 0] * pz
            place = _where(x, y, z, width, shift_z, sizes, palm, reach_m, margins[0], margins[1])
            if place >= 0:
                foreign[place] += 1
                if place <= BETWEEN:
                    bits |= np.uint64(1) << np.uint64(ids[i])
    return bits


@njit(cache=True)
def _check(
    Rs: np.ndarray,
    tips: np.ndarray,
    widths: np.ndarray,
    own: np.ndarray,
    own_seen: np.ndarray,
    own_starts: np.ndarray,
    own_centers: np.ndarray,
    own_radii: np.ndarray,
    own_id: int,
    points: np.ndarray,
    ids: np.ndarray,
    starts: np.ndarray,
    centers: np.ndarray,
    radii: np.ndarray,
    sizes: np.ndarray,
    palm: np.ndarray,
    reach_m: np.ndarray,
    box: np.ndarray,
    support_z_m: float,
    margins: np.ndarray,
    limits: np.ndarray,
    fault: np.ndarray,
    blockers: np.ndarray,
    foreign: np.ndarray,
) -> None:
    local, index = np.empty((len(own), 3)), np.empty(len(own), dtype=np.int64)
    own_box = box.copy()
    own_box[1, 2] = 0.0
    for n in range(len(widths)):
        R, tip, width = Rs[n], tips[n], widths[n]
        shift_z = -reach_at(reach_m, width)
        if not clear_of_support(R, tip, shift_z, sizes, palm, support_z_m, margins[3], margins[4]):
            fault[n] = Fault.TABLE.value
            continue
        count = gather(R, tip, own_box, own, own_starts, own_centers, own_radii, local, index)
        fault[n] = _own_fault(
            local, index, count, own_seen, width, shift_z, sizes, palm, reach_m, margins, limits
        )
        if fault[n] == 0:
            blockers[n] = _foreign(
                R,
                tip,
                width,
                shift_z,
                own_id,
                points,
                ids,
                starts,
                centers,
                radii,
                sizes,
                palm,
                reach_m,
                box,
                margins,
                foreign[n],
            )
