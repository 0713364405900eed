"""What lies between and inside the open fingers at a grasp."""

import numpy as np
from jaxtyping import Bool
from numba import njit

from torc.geometry.arrays import kernel_array
from torc.grasping.cells import box_reached
from torc.grasping.clouds import scene_cells
from torc.grasping.config import ValidityConfig
from torc.grasping.hand import hand_geometry, reach_at
from torc.records import GraspSet, SegmentedScene
from torc.robots.gripper import GripperDescription


def between_and_inside(
    grasps: GraspSet, scene: SegmentedScene, gripper: GripperDescription, config: ValidityConfig
) -> tuple[Bool[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Whether the grasp's own object, and no other, is between the fingers; whether a finger is in its points."""
    cells = scene_cells(scene, config.clouds)
    hand = hand_geometry(gripper)
    Ts, widths_m = kernel_array(grasps.Ts_world_tcp), kernel_array(grasps.widths_m)
    between, inside, foreign = _count(Ts, widths_m, kernel_array(grasps.object_ids, np.int64), cells, hand)
    alone = (between > 0) & (foreign <= config.checks.max_foreign_between)
    return alone, inside > config.checks.max_own_in_fingers


@njit(cache=True)
def _count(Ts, widths, own_ids, cells, hand):
    """Own points between and inside the fingers, and the most points between them that one other object has.

    Between: within the opening along x, within the pads along y, and from the pads' rear end in the open state
    to the closed fingertips along z. Inside: in a finger of the open gripper.
    """
    points, ids = cells.points, cells.tags
    counts = np.zeros((3, len(widths)), np.int64)
    between, inside, foreign = counts[0], counts[1], counts[2]
    box = np.empty((2, 3))
    per_id = np.zeros(64, dtype=np.int64)
    inner, outer = 0.5 * hand.max_width_m, 0.5 * hand.max_width_m + hand.finger_x
    for n in range(len(widths)):
        R, tip = Ts[n, :3, :3].copy(), Ts[n, :3, 3].copy()
        shift_z = -reach_at(hand.reach_m, widths[n])
        box[0, 0], box[0, 1], box[0, 2] = -outer, -hand.finger_y, shift_z - hand.finger_z
        box[1, 0], box[1, 1], box[1, 2] = outer, hand.finger_y, 0.0
        per_id[:] = 0
        for c in range(len(cells.radii)):
            if not box_reached(R, tip, cells.centers[c], cells.radii[c], box):
                continue
            for i in range(cells.starts[c], cells.starts[c + 1]):
                px, py, pz = points[i, 0] - tip[0], points[i, 1] - tip[1], points[i, 2] - tip[2]
                z = R[0, 2] * px + R[1, 2] * py + R[2, 2] * pz
                y = R[0, 1] * px + R[1, 1] * py + R[2, 1] * pz
                if z > 0.0 or z < box[0, 2] or abs(y) > hand.finger_y:
                    continue
                x = abs(R[0, 0] * px + R[1, 0] * py + R[2, 0] * pz)
                if x < inner and abs(y) < hand.pad_y and z > -hand.pad_z:
                    per_id[ids[i]] += 1
                elif x >= inner and x <= outer and z <= shift_z and ids[i] == own_ids[n]:
                    inside[n] += 1
        between[n] = per_id[own_ids[n]]
        per_id[own_ids[n]] = 0
        foreign[n] = per_id.max()
    return between, inside, foreign
