"""What lies between and inside the open fingers at a grasp."""

import numpy as np
from jaxtyping import Bool
from numba import njit

from torc.geometry.arrays import kernel_array
from torc.grasping.cells import box_reached
from torc.grasping.clouds import scene_cells
from torc.grasping.config import ValidityConfig
from torc.grasping.hand import FINGER_X, FINGER_Y, FINGER_Z, OPEN, PAD_Y, PAD_Z, hand_geometry, reach_at
from torc.records import GraspSet, SegmentedScene
from torc.robots.description import GripperDescription


def between_and_inside(
    grasps: GraspSet, scene: SegmentedScene, gripper: GripperDescription, config: ValidityConfig
) -> tuple[Bool[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Whether the grasp's own object, and no other, is between the fingers; whether a finger is in its points."""
    cells = scene_cells(scene, config.clouds)
    hand = hand_geometry(gripper)
    n = len(grasps)
    counts = np.zeros((n, 2), dtype=np.int64)
    foreign = np.zeros(n, dtype=np.int64)
    _count(
        kernel_array(grasps.Ts_world_tcp),
        kernel_array(grasps.widths_m),
        kernel_array(grasps.object_ids, np.int64),
        cells.points,
        cells.tags,
        cells.starts,
        cells.centers,
        cells.radii,
        hand.sizes,
        hand.reach_m,
        counts,
        foreign,
    )
    checks = config.checks
    alone = (counts[:, 0] > 0) & (foreign <= checks.max_foreign_between)
    return alone, counts[:, 1] > checks.max_own_in_fingers


@njit(cache=True)
def _count(
    Ts: np.ndarray,
    widths: np.ndarray,
    own_ids: np.ndarray,
    points: np.ndarray,
    ids: np.ndarray,
    starts: np.ndarray,
    centers: np.ndarray,
    radii: np.ndarray,
    sizes: np.ndarray,
    reach_m: np.ndarray,
    counts: np.ndarray,
    foreign: np.ndarray,
) -> None:
    """Own points between and inside the fingers, and the most points between them that one other object has.

    Between: within the opening along x, within the pads along y, and from the pads' rear end in the open state
    to the closed fingertips along z. Inside: in a finger of the open gripper.
    """
    box = np.empty((2, 3))
    per_id = np.zeros(64, dtype=np.int64)
    inner, outer = 0.5 * sizes[OPEN], 0.5 * sizes[OPEN] + sizes[FINGER_X]
    for n in range(len(widths)):
        R, tip = Ts[n, :3, :3].copy(), Ts[n, :3, 3].copy()
        shift_z = -reach_at(reach_m, widths[n])
        box[0, 0], box[0, 1], box[0, 2] = -outer, -sizes[FINGER_Y], shift_z - sizes[FINGER_Z]
        box[1, 0], box[1, 1], box[1, 2] = outer, sizes[FINGER_Y], 0.0
        per_id[:] = 0
        for c in range(len(radii)):
            if not box_reached(R, tip, centers[c], radii[c], box):
                continue
            for i in range(starts[c], starts[c + 1]):
                px, py, pz = points[i, 0] - tip[0], points[i, 1] - tip[1], points[i, 2] - tip[2]
                z = R[0, 2] * px + R[1, 2] * py + R[2, 2] * pz
                y = R[0, 1] * px + R[1, 1] * py + R[2, 1] * pz
                if z > 0.0 or z < box[0, 2] or abs(y) > sizes[FINGER_Y]:
                    continue
                x = abs(R[0, 0] * px + R[1, 0] * py + R[2, 0] * pz)
                if x < inner and abs(y) < sizes[PAD_Y] and z > -sizes[PAD_Z]:
                    per_id[ids[i]] += 1
                elif x >= inner and x <= outer and z <= shift_z and ids[i] == own_ids[n]:
                    counts[n, 1] += 1
        counts[n, 0] = per_id[own_ids[n]]
        per_id[own_ids[n]] = 0
        foreign[n] = per_id.max()
