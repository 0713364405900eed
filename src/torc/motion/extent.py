"""How far a held object may reach, beyond what the camera sees of it.

Most of an object's back is hidden by itself, and its lower part often by what stands in front of it. A transfer that is
planned for the visible part alone lowers the rest onto the table, or swings it against the bin.
"""

import numpy as np
from jaxtyping import Float

from torc.grasping.cells import thin_out
from torc.grasping.completion import complete
from torc.grasping.config import CloudConfig
from torc.motion.holding import Held, hull_spheres
from torc.records import OcclusionVolume, SegmentedObject


def held_where_it_lies(
    o: SegmentedObject,
    camera_position: Float[np.ndarray, "3"],
    volume: OcclusionVolume,
    support_z_m: float,
    max_spheres: int,
) -> Held:
    """An object as it would be held, world frame, where it lies now; at most about max_spheres for each extent."""
    possible = possible_points(o, camera_position, volume, support_z_m)
    return Held(hull_spheres(o.points.astype(float), max_spheres), hull_spheres(possible, max_spheres))


def possible_points(
    o: SegmentedObject,
    camera_position: Float[np.ndarray, "3"],
    volume: OcclusionVolume,
    support_z_m: float,
    config: CloudConfig | None = None,
) -> Float[np.ndarray, "n 3"]:
    """Points whose hull holds the object, wherever it may go on unseen, where it lies now.

    These are its visible and felt points, the guess at its back (`torc.grasping.completion`), and below all of them the
    space that no snapshot saw, down to the first voxel that was seen, or to the support.

    Args:
        o: the object.
        camera_position: of the snapshot, world frame.
        volume: what was seen.
        support_z_m: height of the table top.
        config: how thin the points are, and how deep the guess is.

    Returns:
        World frame; none for an object without visible points.
    """
    config = CloudConfig() if config is None else config
    if len(o.points) == 0:
        return np.zeros((0, 3))
    points, normals = thin_out(o.points, o.normals, config.voxel_m)
    felt = o.felt.astype(points.dtype)
    guess = complete(points, normals, felt, camera_position, o.id, volume, support_z_m, config)
    known = np.concatenate([points, felt, guess.points])
    return np.concatenate([known, unseen_below(known, o.id, volume)])


def unseen_below(
    points: Float[np.ndarray, "n 3"], object_id: int, volume: OcclusionVolume
) -> Float[np.ndarray, "m 3"]:
    """Where the unseen space under the points ends: a point per column of voxels."""
    grid = volume.grid
    index = grid.index_of(points)
    index = index[grid.contains(index)]
    columns, which = np.unique(index[:, :2], axis=0, return_inverse=True)
    lowest = np.full(len(columns), grid.shape[2])
    np.minimum.at(lowest, which.ravel(), index[:, 2])
    x, y = columns.T
    taken = volume.seen[x, y] & (volume.surface_label[x, y] != object_id)
    taken &= np.arange(grid.shape[2]) < lowest[:, None]
    # One past the highest voxel below that cannot be the object's.
    bottom = np.where(taken.any(axis=1), grid.shape[2] - np.argmax(taken[:, ::-1], axis=1), 0)
    below = bottom < lowest
    xy = grid.origin[:2] + grid.voxel_size_m * (columns[below] + 0.5)
    return np.column_stack([xy, grid.origin[2] + grid.voxel_size_m * bottom[below]])
