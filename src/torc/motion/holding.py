"""Model a held object as spheres over a convex hull (paper: A Modular Pipeline, step 4), and how far it may reach.

Most of an object's back is hidden by itself, and its lower part often by what stands in front of it. A transfer planned
for the visible part alone lowers the rest onto the table, or swings it against the bin.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import binary_erosion
from scipy.spatial import ConvexHull, QhullError, cKDTree

from torc.geometry.transforms import Pose, transform_points
from torc.grasping.cells import thin_out
from torc.grasping.completion import complete
from torc.grasping.config import CloudConfig
from torc.records import OcclusionVolume, SegmentedObject

_MAX_POINTS = 1000


@dataclass(frozen=True)
class Held:
    """An object that is held, as spheres (x, y, z, radius).

    Attributes:
        seen: the hull of its visible points.
        possible: the hull of all that it may be, including unseen parts; see `possible_points`.
    """

    seen: Float[np.ndarray, "a 4"]
    possible: Float[np.ndarray, "b 4"]

    def moved(self, T: Pose) -> "Held":
        """Return it in another frame: T takes points of this frame to that one."""
        both = (self.seen, self.possible)
        return Held(*(np.hstack([transform_points(T, s[:, :3]), s[:, 3:]]) for s in both))


def hull_spheres(points: Float[np.ndarray, "n 3"], max_spheres: int) -> Float[np.ndarray, "a 4"]:
    """Return about max_spheres equal spheres (x, y, z, radius) that cover the surface of the points' convex hull.

    The hull is cut into cubes along its principal axes, as small as the number allows; each outer cube becomes a
    sphere. Deterministic. No points give no spheres.
    """
    points = np.asarray(points, dtype=float)
    points = points[np.all(np.isfinite(points), axis=1)]
    points = points[:: max(1, len(points) // _MAX_POINTS)]
    if len(points) == 0:
        return np.zeros((0, 4))
    center = points.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov(points.T) if len(points) > 1 else np.eye(3))
    local = (points - center) @ axes
    low, high = local.min(axis=0), local.max(axis=0)
    planes = _hull_planes(local)
    x, y, z = high - low
    # First guess, from below: the cubes that would pave the bounding box's surface.
    cell = max(0.012, 0.7 * float(np.sqrt(2 * (x * y + y * z + z * x) / max_spheres)))
    while True:
        centers = _outer_cells(low, high, planes, cell)
        if len(centers) <= max_spheres:
            break
        cell *= 1.15
    if len(centers) == 0:
        # A hull so thin that it passes between all centres: use the cubes that hold points.
        centers = (np.unique(np.floor(local / cell), axis=0) + 0.5) * cell
    # Corners of the hull may stick out between the spheres: those get their own spheres, one per cube.
    radius = 0.78 * cell
    uncovered = local[cKDTree(centers).query(local)[0] > radius]
    _, first = np.unique(np.floor(uncovered / (0.7 * radius)), axis=0, return_index=True)
    centers = np.vstack([centers, uncovered[np.sort(first)]])
    return np.hstack([centers @ axes.T + center, np.full((len(centers), 1), radius)])


def _hull_planes(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "f 4"]:
    """Return outward planes (normal, offset) of the hull; those of the bounding box if the points are flat."""
    try:
        return ConvexHull(points).equations
    except QhullError:
        low, high = points.min(axis=0), points.max(axis=0)
        return np.vstack([np.hstack([np.eye(3), -high[:, None]]), np.hstack([-np.eye(3), low[:, None]])])


def _outer_cells(
    low: np.ndarray, high: np.ndarray, planes: np.ndarray, cell: float
) -> Float[np.ndarray, "c 3"]:
    """Return centres of the cubes that lie in the hull and have a neighbour that does not."""
    n = np.maximum(1, np.ceil((high - low) / cell).astype(int))
    start = 0.5 * (low + high) - 0.5 * cell * (n - 1)
    index = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    centers = start + cell * index
    inside = np.all(centers @ planes[:, :3].T + planes[:, 3] <= 0.25 * cell, axis=1).reshape(n)
    return centers[(inside & ~binary_erosion(inside)).ravel()]


def held_where_it_lies(
    o: SegmentedObject,
    camera_position: Float[np.ndarray, "3"],
    volume: OcclusionVolume,
    support_z_m: float,
    max_spheres: int,
) -> Held:
    """Return an object as it would be held, world frame, where it is now; about max_spheres at most for each extent."""
    possible = possible_points(o, camera_position, volume, support_z_m)
    return Held(hull_spheres(o.points.astype(float), max_spheres), hull_spheres(possible, max_spheres))


def possible_points(
    o: SegmentedObject, camera_position: Float[np.ndarray, "3"], volume: OcclusionVolume, support_z_m: float
) -> Float[np.ndarray, "n 3"]:
    """Return points (world frame) whose hull holds the object where it is now, wherever it may extend unseen.

    These are its visible and felt points, the guess at its back (`torc.grasping.completion`), and below all of them the
    space that no snapshot saw, down to the first voxel that was seen, or to the support. None for an object without
    visible points.
    """
    config = CloudConfig()
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
    """Return where the unseen space under the points ends: a point per column of voxels."""
    grid = volume.grid
    index = grid.index_of(points)
    index = index[grid.contains(index)]
    columns, which = np.unique(index[:, :2], axis=0, return_inverse=True)
    lowest = np.full(len(columns), grid.shape[2])
    np.minimum.at(lowest, which.ravel(), index[:, 2])
    x, y = columns.T
    taken = volume.seen[x, y] & (volume.surface_label[x, y] != object_id)
    taken &= np.arange(grid.shape[2]) < lowest[:, None]
    # One above the highest voxel below that cannot be the object's.
    bottom = np.where(taken.any(axis=1), grid.shape[2] - np.argmax(taken[:, ::-1], axis=1), 0)
    below = bottom < lowest
    xy = grid.origin[:2] + grid.voxel_size_m * (columns[below] + 0.5)
    return np.column_stack([xy, grid.origin[2] + grid.voxel_size_m * bottom[below]])
