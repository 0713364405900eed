"""Measure candidates, as input of the score.

Grasp frame: x closing, z approach, closed fingertips at z = 0. "Pads": the volume between the pads. "Seen" points were
seen, "all" includes those guessed on the hidden back. A contact is a point between the pads within 8 mm of the
outermost one on its side; it is aligned if its normal is within 30 degrees of the closing axis. Lengths are in metres;
points are those of the thinned-out clouds.
"""

import numpy as np
from jaxtyping import Float, Float32, Int32
from numba import njit

from torc.geometry.transforms import kernel_array
from torc.grasping.cells import PointCells
from torc.grasping.clouds import ObjectCloud
from torc.grasping.feature_kernels import candidate_features
from torc.grasping.generators.common import RawCandidates
from torc.grasping.hand import HandGeometry
from torc.records import OcclusionVolume

_CANDIDATE_FEATURES = {
    "seen_aligned_min": "aligned seen contacts on the side with fewer",
    "seen_aligned_max": "aligned seen contacts on the side with more",
    "all_aligned_min": "aligned contacts on the side with fewer",
    "all_aligned_max": "aligned contacts on the side with more",
    "seen_contacts_min": "seen contacts on the side with fewer",
    "seen_contacts_max": "seen contacts on the side with more",
    "all_contacts_min": "contacts on the side with fewer",
    "all_contacts_max": "contacts on the side with more",
    "alignment_min": "mean cosine between outward normals and closing axis, worse side; -1 without contacts",
    "alignment_max": "the same, better side",
    "contact_height_min": "extent of the contacts along the approach, smaller side",
    "contact_breadth_min": "extent of the contacts along the pads' breadth, smaller side",
    "contact_behind_tip": "mean distance of the contacts behind the fingertips",
    "contact_behind_tip_min": "that of the side nearer to the fingertips",
    "seen_between": "seen points between the pads",
    "all_between": "points between the pads",
    "extent_y": "their extent along the pads' breadth",
    "extent_z": "their extent along the approach",
    "penetration": "how far the fingertips reach below the first seen point of the strip they close on",
    "beyond_tips": "how far the object goes on beyond the fingertips, within that strip",
    "wider_beyond": "width of what lies beyond the fingertips in that strip, less the grasp's width",
    "object_x": "extent of the whole object along the closing axis",
    "object_y": "extent of the whole object along the pads' breadth",
    "object_z": "extent of the whole object along the approach",
    "off_center_x": "distance along the closing axis from the whole object's middle",
    "off_center_y": "distance along the pads' breadth from the whole object's middle",
    "width": "distance between the closed pads",
    "width_margin": "opening left over",
    "seen_width": "extent along the closing axis of the seen points between the pads",
    "lever": "distance of the centre of mass from the line between the contacts",
    "lever_level": "horizontal distance of the centre of mass from the middle between the pads",
    "mass_below": "height of the middle between the pads above the centre of mass",
    "closing_vertical": "|cosine| between closing axis and vertical",
    "breadth_vertical": "|cosine| between the pads' breadth and vertical",
    "approach_down": "cosine between approach and straight down",
    "approach_view": "cosine between approach and the horizontal viewing direction",
    "closing_view": "|cosine| between closing axis and the horizontal viewing direction",
    "tip_height": "height of the TCP above the support",
    "clearance": "height of the lowest fingertip corner above the support",
    "tip_above_bottom": "height of the TCP above the object's lowest point",
    "top_above_tip": "height of the object's top above the TCP",
    "unknown_finger_max": "share of a finger's volume, on its way, that was never seen: the larger one",
    "unknown_finger_mean": "the same, mean of both fingers",
    "unknown_finger_other": "share of both fingers' volume that is unseen and not hidden by the object itself",
    "unknown_palm": "share of the palm's volume that was never seen",
    "unknown_between": "share of the volume between the pads that was never seen",
    "foreign_fingers": "points of other objects in the fingers' sweep",
    "foreign_palm": "points of other objects in the palm",
    "foreign_between": "points of other objects between the pads",
    "foreign_near": "points of other objects within 12 mm of the fingers' sweep",
    "foreign_corridor": "points of other objects in what the gripper passes on its last 10 cm",
}
_OBJECT_FEATURES = {
    "depth": "estimated extent along the viewing direction",
    "breadth": "extent across the viewing direction",
    "height": "extent along the vertical",
    "seen_depth_share": "share of the estimated depth that was seen",
    "bottom_height": "height of the object's lowest point above the support",
    "log_points": "log(1 + seen points)",
    "log_pixels": "log(1 + pixels of the mask)",
    "log_foreign_above": "log(1 + points of other objects above it)",
    "log_foreign_touching": "log(1 + points of other objects within 8 mm of its seen points)",
    "flatness": "least over middle principal extent of its seen points",
    "roundness": "spread of its seen normals: 0 one plane .. 1 all directions alike",
    "camera_distance": "from the camera to its centre",
    "roughness": "mean distance of its seen points from the planes through those near by",
    "support_roughness": "standard deviation of the support's seen height: what the depth camera is worth",
    "sureness": "how surely its mask is one object, 1 where masks are given",
}
FEATURE_NAMES: tuple[str, ...] = (*_CANDIDATE_FEATURES, *_OBJECT_FEATURES)
"""Names of the columns."""
_COLUMN_M = 0.01
_TOUCH_M = 0.008


def compute_features(
    candidates: RawCandidates,
    foreign: Int32[np.ndarray, "n 5"],
    cloud: ObjectCloud,
    cells: PointCells,
    hand: HandGeometry,
    volume: OcclusionVolume,
    support_z_m: float,
    camera_position: Float[np.ndarray, "3"],
) -> Float32[np.ndarray, "n f"]:
    """Return the features of the candidates of one object. `foreign`: see `candidate_checks.CheckResult`."""
    out = np.zeros((len(candidates), len(FEATURE_NAMES)), dtype=np.float32)
    if len(candidates) == 0:
        return out
    completion = cloud.completion
    first = len(_CANDIDATE_FEATURES) - foreign.shape[1]
    out[:, first : first + foreign.shape[1]] = foreign
    out[:, len(_CANDIDATE_FEATURES) :] = _object_features(cloud, cells, support_z_m, camera_position)
    place = [*completion.center, *completion.view, cloud.points[:, 2].min(), cloud.seen[:, 2].max()]
    space = (
        kernel_array(volume.seen, np.bool_),
        kernel_array(volume.hidden_by, np.uint64),
        np.uint64(1) << np.uint64(cloud.id),
        kernel_array(volume.grid.origin),
        float(volume.grid.voxel_size_m),
    )
    candidate_features(
        candidates.Rs,
        candidates.tips,
        candidates.widths_m,
        cloud.cells,
        cloud.normals[cloud.cells.order],
        cloud.hull,
        np.array(place),
        hand,
        space,
        support_z_m,
        out,
    )
    return out


def _object_features(
    cloud: ObjectCloud, cells: PointCells, support_z_m: float, camera_position: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "f"]:
    """Return values in the order of _OBJECT_FEATURES."""
    seen, normals = cloud.points[: cloud.visible], cloud.normals[: cloud.visible]
    low, high = seen.min(axis=0), seen.max(axis=0)
    above, touching = _neighbours(seen, cells, cloud.id, low, high)
    extents = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(seen.T)), 0.0)) if len(seen) > 2 else np.zeros(3)
    spread = np.linalg.eigvalsh(normals.T @ normals / max(len(normals), 1))
    done = cloud.completion
    return np.array(
        [
            *done.size_m,
            min(1.0, done.seen_depth_m / max(done.size_m[0], 1e-6)),
            done.center[2] - done.size_m[2] / 2 - support_z_m,
            np.log1p(cloud.visible),
            np.log1p(cloud.pixel_count),
            np.log1p(above),
            np.log1p(touching),
            extents[0] / max(extents[1], 1e-6),
            1.5 * (1.0 - spread[2] / max(spread.sum(), 1e-9)),
            np.linalg.norm(done.center - camera_position),
            cloud.roughness_m,
            cloud.support_roughness_m,
            cloud.sureness,
        ]
    )


@njit(cache=True, nogil=True)
def _neighbours(own, cells, own_id, low, high):
    """Count others' points above the own ones (in 1 cm columns), and others' points close to an own one.

    `low` and `high`: bounds of the own points.
    """
    nx = int((own[:, 0].max() - low[0]) / _COLUMN_M) + 1
    ny = int((own[:, 1].max() - low[1]) / _COLUMN_M) + 1
    top = np.full((nx, ny), 1e9)
    for p in own:
        i, j = int((p[0] - low[0]) / _COLUMN_M), int((p[1] - low[1]) / _COLUMN_M)
        if top[i, j] > 1e8 or p[2] > top[i, j]:
            top[i, j] = p[2]
    above, touching = 0, 0
    for c in range(len(cells.tags)):
        q = cells.points[c]
        beside = q[0] <= low[0] - _TOUCH_M or q[0] >= high[0] + _TOUCH_M
        beside |= q[1] <= low[1] - _TOUCH_M or q[1] >= high[1] + _TOUCH_M
        if cells.tags[c] == own_id or beside or q[2] <= low[2] - _TOUCH_M or q[2] >= high[2] + 1.0:
            continue
        if q[0] >= low[0] and q[1] >= low[1]:
            i, j = int((q[0] - low[0]) / _COLUMN_M), int((q[1] - low[1]) / _COLUMN_M)
            if i < nx and j < ny and q[2] > top[i, j]:
                above += 1
        for p in own:
            dx, dy, dz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
            if dx * dx + dy * dy + dz * dz < _TOUCH_M * _TOUCH_M:
                touching += 1
                break
    return above, touching
