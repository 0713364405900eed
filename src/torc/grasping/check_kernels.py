"""The hard checks of candidates, compiled: each candidate against its own object's points, then against all others'."""

import numpy as np
from numba import njit

from torc.grasping.cells import gather
from torc.grasping.check_result import BETWEEN, CORRIDOR, CORRIDOR_M, FINGERS, NEAR, NEAR_M, PALM, Fault
from torc.grasping.hand import FINGER_X, FINGER_Y, FINGER_Z, OPEN, PAD_Y, PAD_Z, reach_at, sweep_end_z
from torc.grasping.hand_volume import between_pads, clear_of_support, in_fingers, in_palm

FINGER_MARGIN, PALM_MARGIN, OWN_SLACK, TABLE_MARGIN, TIP_MARGIN, APPROACH = range(6)
"""Columns of `margins`: the lengths of CheckConfig, metres."""
IN_FINGERS, TO_HOLD = range(2)
"""Columns of `limits`: own points in the fingers at most, between the pads at least."""


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
        if in_fingers(x, y, z, width, shift_z, margins[APPROACH], 0.0, margins[OWN_SLACK], sizes, reach_m):
            in_finger += 1
            if in_finger > limits[IN_FINGERS]:
                return Fault.OWN_IN_FINGERS.value
        if in_palm(x, y, z, shift_z, margins[PALM_MARGIN], palm_ranges):
            return Fault.OWN_IN_PALM.value
        if between_pads(x, y, z, 0.5 * width + margins[OWN_SLACK], sizes):
            between += 1
    return Fault.TOO_FEW_POINTS.value if between < limits[TO_HOLD] else Fault.NONE.value


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
    half, outer = 0.5 * width, 0.5 * sizes[OPEN] + sizes[FINGER_X]
    pad_y, pad_z, finger_y = sizes[PAD_Y], sizes[PAD_Z], sizes[FINGER_Y]
    back, margin = shift_z - sizes[FINGER_Z], margins[FINGER_MARGIN]
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
            at = _palm_place(
                local[k, 0], local[k, 1], z - shift_z, palm_ranges, palm_box, margins[PALM_MARGIN]
            )
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
def check_all(
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
    """Fault, blockers and counts of other objects' points, per candidate; writes the last three arrays in place.

    `box`: where points of other objects matter at all; `palm_box`: see `checks.palm_bounds`.
    """
    local, index = np.empty((len(own), 3)), np.empty(len(own), dtype=np.int64)
    others, other_index = np.empty((len(points), 3)), np.empty(len(points), dtype=np.int64)
    own_box, ahead, box_behind = box.copy(), box.copy(), box.copy()
    own_box[1, 2] = 0.0
    ahead[1, 0], ahead[1, 1] = 0.5 * sizes[OPEN] + sizes[FINGER_X] + NEAR_M, sizes[FINGER_Y] + NEAR_M
    ahead[0, 0], ahead[0, 1] = -ahead[1, 0], -ahead[1, 1]
    for n in range(len(widths)):
        R, tip, width = Rs[n], tips[n], widths[n]
        shift_z = -reach_at(reach_m, width)
        if not clear_of_support(
            R, tip, shift_z, sizes, palm, support_z_m, margins[TABLE_MARGIN], margins[TIP_MARGIN]
        ):
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
