"""Guess the hidden back of an object that is seen from one side.

From a camera that looks slightly down, most of an object's back is hidden. Its depth along the viewing ray is assumed
to be its seen depth, or about its width if that is more. The seen points are repeated after half a turn about the
vertical through its middle, except where a snapshot has seen free space. For upright boxes (whatever their yaw), cans
and bottles this is exact if the middle is; a mirror image would turn a box the other way. It doubles the share of
objects with antipodal grasps.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numba import njit

from torc.geometry.transforms import kernel_array
from torc.grasping.cells import cell_keys
from torc.grasping.config import CloudConfig
from torc.records import BACKGROUND, EMPTY, OcclusionVolume

_STRAY_POINTS = 2
_NEAR_SUPPORT_M = 0.03


@dataclass(frozen=True)
class AssumedBody:
    """The upright box that an object is assumed to fill.

    Attributes:
        center: estimated centre of mass, world frame.
        view: horizontal unit direction from the camera to the object.
        size_m: extent along `view`, across it, and in height.
        seen_depth_m: extent along `view` of what is seen and felt.
    """

    center: Float[np.ndarray, "3"]
    view: Float[np.ndarray, "3"]
    size_m: Float[np.ndarray, "3"]
    seen_depth_m: float


@dataclass(frozen=True)
class Completion(AssumedBody):
    """That box, and points of the back with outward normals that nothing contradicts, world frame."""

    points: Float[np.ndarray, "m 3"]
    normals: Float[np.ndarray, "m 3"]


def complete(
    points: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    felt: Float[np.ndarray, "k 3"],
    camera_position: Float[np.ndarray, "3"],
    object_id: int,
    volume: OcclusionVolume,
    support_z_m: float,
    config: CloudConfig,
) -> Completion:
    """Guess the hidden back of one object from its seen points, and those that a finger `felt`; world frame.

    The volume rules out guesses in space that was seen free, or to hold another object.
    """
    body = assumed_body(points, felt, camera_position, support_z_m, config)
    turned, outward = _turned_half(points, body.center), _turned_half(normals, np.zeros(3))
    keep = ~_contradicted(turned, object_id, volume) & ~_seen_already(turned, points, 1.5 * config.voxel_m)
    return Completion(**vars(body), points=turned[keep], normals=outward[keep])


def assumed_body(
    points: Float[np.ndarray, "n 3"],
    felt: Float[np.ndarray, "k 3"],
    camera_position: Float[np.ndarray, "3"],
    support_z_m: float,
    config: CloudConfig,
) -> AssumedBody:
    """Return the box that an object is assumed to fill, from its seen and felt points, world frame."""
    view = points.mean(axis=0) - camera_position
    view = np.array([view[0], view[1], 0.0])
    norm = np.linalg.norm(view)
    view = view / norm if norm > 1e-6 else np.array([1.0, 0.0, 0.0])
    across = np.array([-view[1], view[0], 0.0])
    low, high = robust_range(np.stack([points @ view, points @ across, points[:, 2]], axis=1))
    if low[2] - support_z_m < _NEAR_SUPPORT_M:
        low[2] = support_z_m
    seen, width, height = high - low
    if len(felt):
        seen = max(seen, float((felt @ view).max() - low[0]))
    depth = float(hidden_depth(seen, width, height, config))
    middle = low[0] + depth / 2
    center = middle * view + (low[1] + high[1]) / 2 * across + np.array([0, 0, (low[2] + high[2]) / 2])
    return AssumedBody(center, view, np.array([depth, width, height]), float(seen))


def robust_range(values: Float[np.ndarray, "n k"]) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"]]:
    """Return the least and greatest value per column, leaving out two stray points at either end."""
    return _ranked(kernel_array(values), min(_STRAY_POINTS, (len(values) - 1) // 2))


@njit(cache=True, nogil=True)
def _ranked(values, skip):
    """Return, per column, the values that `skip` others are below, and above."""
    n, columns = values.shape
    low, high = np.full((columns, skip + 1), np.inf), np.full((columns, skip + 1), -np.inf)
    for i in range(n):
        for c in range(columns):
            if values[i, c] < low[c, skip]:
                at = skip
                while at > 0 and values[i, c] < low[c, at - 1]:
                    low[c, at] = low[c, at - 1]
                    at -= 1
                low[c, at] = values[i, c]
            if values[i, c] > high[c, skip]:
                at = skip
                while at > 0 and values[i, c] > high[c, at - 1]:
                    high[c, at] = high[c, at - 1]
                    at -= 1
                high[c, at] = values[i, c]
    return low[:, skip], high[:, skip]


def _turned_half(
    points: Float[np.ndarray, "n 3"], center: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "n 3"]:
    """Turn points by half a turn about the vertical through a centre."""
    out = points.copy()
    out[:, :2] = 2 * center[:2] - points[:, :2]
    return out


def hidden_depth(seen_m: float, width_m: float, height_m: float, config: CloudConfig) -> float:
    """Estimate an object's depth along the viewing ray from its visible part."""
    by_height = max(config.min_hidden_depth_m, config.depth_per_height * height_m)
    return max(seen_m, min(width_m, config.max_hidden_depth_m, by_height))


def _contradicted(points: np.ndarray, object_id: int, volume: OcclusionVolume) -> Bool[np.ndarray, "n"]:
    """Return which points lie in voxels that were seen to be free, or to hold another object."""
    out = volume.free_at(points)
    index = volume.grid.index_of(points)
    inside = volume.grid.contains(index)
    label = volume.surface_label[tuple(index[inside].T)]
    out[inside] |= (label != EMPTY) & (label != object_id) & (label != BACKGROUND)
    return out


def _seen_already(turned: np.ndarray, points: np.ndarray, cell_m: float) -> Bool[np.ndarray, "n"]:
    """Return which turned points lie in cells that hold seen points."""
    cell = cell_keys(np.concatenate([points, turned]), cell_m)
    return np.isin(cell[len(points) :], cell[: len(points)])
