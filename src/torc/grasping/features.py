"""What is measured of a candidate, as input of the score.

Grasp frame: x closing, z approach, closed fingertips at z = 0. "Pads": the volume between the pads. "Seen" points
were seen, "all" includes those guessed on the hidden back. A contact is a point between the pads within
8 mm of the outermost one on its side; it is aligned if its normal is within 30 degrees of the closing axis.
Lengths in metres; points are those of the thinned-out clouds.
"""

from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Float32, Int32

from torc.geometry.arrays import kernel_array
from torc.grasping.cells import PointCells
from torc.grasping.clouds import ObjectCloud
from torc.grasping.feature_kernels import candidate_features
from torc.grasping.generators.common import RawCandidates
from torc.grasping.hand import HandGeometry
from torc.grasping.object_features import OBJECT_FEATURES, object_features
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
FEATURE_DOCS = MappingProxyType({**_CANDIDATE_FEATURES, **OBJECT_FEATURES})
"""What each feature is, by name, in the order of the columns."""
FEATURE_NAMES: tuple[str, ...] = tuple(FEATURE_DOCS)
"""Names of the columns."""


def feature_column(name: str) -> int:
    """Column of a feature. Raises ValueError for an unknown name."""
    return FEATURE_NAMES.index(name)


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
    """Features of the candidates of one object. `foreign`: see `check_result.CheckResult`."""
    out = np.zeros((len(candidates), len(FEATURE_NAMES)), dtype=np.float32)
    if len(candidates) == 0:
        return out
    completion = cloud.completion
    first = len(_CANDIDATE_FEATURES) - foreign.shape[1]
    out[:, first : first + foreign.shape[1]] = foreign
    out[:, len(_CANDIDATE_FEATURES) :] = object_features(cloud, cells, support_z_m, camera_position)
    candidate_features(
        candidates.Rs,
        candidates.tips,
        candidates.widths_m,
        cloud.cells.points,
        cloud.normals[cloud.cells.order],
        cloud.cells.tags,
        cloud.cells.starts,
        cloud.cells.centers,
        cloud.cells.radii,
        cloud.hull,
        cloud.id,
        np.concatenate(
            [completion.center, completion.view, [cloud.points[:, 2].min(), cloud.seen[:, 2].max()]]
        ),
        hand.sizes,
        hand.palm,
        hand.reach_m,
        kernel_array(volume.seen, np.bool_),
        kernel_array(volume.hidden_by, np.uint64),
        kernel_array(volume.grid.origin),
        float(volume.grid.voxel_size_m),
        support_z_m,
        out,
    )
    return out
