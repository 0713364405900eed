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

from torc.grasping.cells import PointCells, gather
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
        hand.palm_ranges,
        hand.reach_m,
        box,
        _palm_bounds(hand, config.palm_margin_m),
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


def _palm_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Largest |x|, |y| and z of the palm boxes, in the second row; relative to the open gripper's TCP."""
    if len(hand.palm) == 0:
        return np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    upper = (np.abs(hand.palm[:, :3]) + hand.palm[:, 3:]).max(axis=0)
    upper[2] = (hand.palm[:, 2] + hand.palm[:, 5]).max()
    return np.stack([-upper, upper + margin_m])


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
    palm_ranges: np.ndarray,
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
        if in_palm(x, y, z, shift_z, margins[1], palm_ranges):
            return Fault.OWN_IN_PALM.value
        if between_pads(x, y, z, 0.5 * width + margins[2], sizes):
            between += 1
    return Fault.TOO_FEW_POINTS.value if between < limits[1] else Fault.NONE.value


@njit(cache=True)
def _foreign(
    local: np.ndarray,
    index: np.ndarray,
    count: int,
    ids: np.ndarray,
    own_id: int,
    width: float,
    shift_z: float,
    sizes: np.ndarray,
    palm_ranges: np.ndarray,
    palm_box: np.ndarray,
    reach_m: np.ndarray,
    margins: np.ndarray,
    foreign: np.ndarray,
) -> np.uint64:
    """Count points of other objects (grasp frame) by place; returns the bits of those that are in the way."""
    bits = np.uint64(0)
    half, outer, pad_y, pad_z, finger_y = 0.5 * width, 0.5 * sizes[0] + sizes[4], sizes[1], sizes[2], sizes[3]
    back, margin = shift_z - sizes[5], margins[0]
    for k in range(count):
        if ids[index[k]] == own_id:
            continue
        x, y, z = abs(local[k, 0]), abs(local[k, 1]), local[k, 2]
        place = -1
        if x < half:
            if y < pad_y and z <= 0.0 and z > -pad_z:
                place = BETWEEN
        elif x < outer + NEAR_M and y < finger_y + NEAR_M:
            end = sweep_end_z(x - margin, width, shift_z, sizes, reach_m)
            if x < outer + margin and y < finger_y + margin and z < end + margin:
                if z > back - margin:
                    place = FINGERS
                elif z > back - CORRIDOR_M:
                    place = CORRIDOR
            if place != FINGERS and z < end + NEAR_M and z > back - NEAR_M:
                place = NEAR
        if place < 0 or place > BETWEEN:
            at = _palm_place(local[k, 0], local[k, 1], z - shift_z, palm_ranges, palm_box, margins[1])
            if at == PALM or place < 0:
                place = at
        if place >= 0:
            foreign[place] += 1
            if place <= BETWEEN:
                bits |= np.uint64(1) << np.uint64(ids[index[k]])
    return bits


@njit(cache=True)
def _palm_place(
    x: float, y: float, z: float, palm_ranges: np.ndarray, palm_box: np.ndarray, margin_m: float
) -> int:
    """PALM, CORRIDOR or -1 for a point in the frame of the open gripper's TCP."""
    if z > palm_box[1, 2] or abs(y) > palm_box[1, 1] or abs(x) > palm_box[1, 0]:
        return -1
    place = -1
    x, y = abs(x) - margin_m, abs(y) - margin_m
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
    palm_ranges: np.ndarray,
    reach_m: np.ndarray,
    box: np.ndarray,
    palm_box: np.ndarray,
    support_z_m: float,
    margins: np.ndarray,
    limits: np.ndarray,
    fault: np.ndarray,
    blockers: np.ndarray,
    foreign: np.ndarray,
) -> None:
    local, index = np.empty((len(own), 3)), np.empty(len(own), dtype=np.int64)
    others, other_index = np.empty((len(points), 3)), np.empty(len(points), dtype=np.int64)
    own_box, ahead, box_behind = box.copy(), box.copy(), box.copy()
    own_box[1, 2] = 0.0
    ahead[1, 0], ahead[1, 1] = 0.5 * sizes[0] + sizes[4] + NEAR_M, sizes[3] + NEAR_M
    ahead[0, 0], ahead[0, 1] = -ahead[1, 0], -ahead[1, 1]
    for n in range(len(widths)):
        R, tip, width = Rs[n], tips[n], widths[n]
        shift_z = -reach_at(reach_m, width)
        if not clear_of_support(R, tip, shift_z, sizes, palm, support_z_m, margins[3], margins[4]):
            fault[n] = Fault.TABLE.value
            continue
        count = gather(R, tip, own_box, own, own_starts, own_centers, own_radii, local, index)
        fault[n] = _own_fault(
            local, index, count, own_seen, width, shift_z, sizes, palm_ranges, reach_m, margins, limits
        )
        if fault[n] == 0:
            # Ahead of the palm only the fingers' surroundings matter, a much narrower box.
            ahead[0, 2] = box_behind[1, 2] = palm_box[1, 2] + shift_z
            count = gather(R, tip, ahead, points, starts, centers, radii, others, other_index)
            count += gather(
                R, tip, box_behind, points, starts, centers, radii, others[count:], other_index[count:]
            )
            blockers[n] = _foreign(
                others,
                other_index,
                count,
                ids,
                own_id,
                width,
                shift_z,
                sizes,
                palm_ranges,
                palm_box,
                reach_m,
                margins,
                foreign[n],
            )
