"""Where the objects stand, from one frame: height of the support surface and a voxel grid around the objects."""

import cv2
import numpy as np
from jaxtyping import Bool, Float

from torc.errors import InputError
from torc.geometry.transforms import unproject
from torc.records import BACKGROUND, Observation, VoxelGrid

_HORIZONTAL_COS = 0.966
"""Least |z| of a unit normal of a horizontal surface: 15 deg."""
_STEP_PX = 3
"""Normals come from points this far to both sides: nearer ones drown in sensor noise."""
_BIN_M = 0.004
_MIN_POINTS = 100
_BELOW_LOWEST_M = 0.02
"""The support may seem to lie this far above the objects' lowest points (noise, tilt of the camera)."""
_MAX_VOXELS = 4_000_000


def object_points(observation: Observation) -> Float[np.ndarray, "n 3"]:
    """World points of all pixels with a depth that show an object."""
    label, depth = observation.label_image, observation.depth_m
    assert label is not None  # every frame has one
    rows, cols = np.nonzero((label >= 0) & (depth > 0))
    return unproject(rows, cols, depth[rows, cols].astype(float), observation.K, observation.T_world_camera)


def estimate_support_z_m(observation: Observation) -> float:
    """Height of the horizontal surface that the objects stand on.

    Background pixels whose surface is horizontal are counted by height. Of the heights where many lie (the table,
    perhaps the floor, a shelf) it is the highest one that is not above the objects' lowest points.

    Raises InputError if too little of any horizontal surface is in sight.
    """
    lowest = float(np.percentile(object_points(observation)[:, 2], 1))
    points, horizontal = _background_normals(observation)
    heights = points[horizontal][:, 2]
    heights = heights[heights < lowest + _BELOW_LOWEST_M]
    if len(heights) < _MIN_POINTS:
        raise InputError(
            f"The height of the support surface cannot be estimated: only {len(heights)} background pixels show a "
            "horizontal surface below the objects. Give support_z_m; or the camera pose is wrong."
        )
    start = heights.min() - _BIN_M / 2
    counts = np.bincount(((heights - start) / _BIN_M).astype(int))
    smooth = np.convolve(counts, np.ones(3), "same")
    peak = int(np.flatnonzero(smooth >= 0.15 * smooth.max())[-1])
    # From the first bin that is high enough, climb down to the top of that peak.
    while peak > 0 and smooth[peak - 1] > smooth[peak]:
        peak -= 1
    center = start + (peak + 0.5) * _BIN_M
    return float(np.median(heights[np.abs(heights - center) < 2.5 * _BIN_M]))


def _background_normals(observation: Observation) -> tuple[Float[np.ndarray, "n 3"], Bool[np.ndarray, "n"]]:
    """Points of background pixels, and whether the surface there is horizontal."""
    depth, label = observation.depth_m, observation.label_image
    rows, cols = np.mgrid[: depth.shape[0], : depth.shape[1]]
    points = unproject(rows, cols, depth.astype(float), observation.K, observation.T_world_camera)
    s = _STEP_PX
    across = points[s:-s, 2 * s :] - points[s:-s, : -2 * s]
    down = points[2 * s :, s:-s] - points[: -2 * s, s:-s]
    normal = np.cross(across, down)
    length = np.linalg.norm(normal, axis=-1)
    cross = np.zeros((2 * s + 1, 2 * s + 1), np.uint8)
    cross[s, ::s] = cross[::s, s] = 1
    good = ((depth > 0) & (label == BACKGROUND)).astype(np.uint8)
    usable = (cv2.erode(good, cross)[s:-s, s:-s] > 0) & (length > 0)
    horizontal = np.abs(normal[..., 2]) > _HORIZONTAL_COS * length
    return points[s:-s, s:-s][usable], horizontal[usable]


def grid_around(
    points: Float[np.ndarray, "n 3"],
    support_z_m: float,
    voxel_size_m: float = 0.01,
    margin_m: float = 0.15,
    headroom_m: float = 0.10,
) -> VoxelGrid:
    """A grid over the objects' points: its floor on the support, with room around for what they hide.

    Outliers (the outermost half per cent along each axis) do not count. Raises InputError if the objects are spread
    too widely for a grid of that resolution.
    """
    low, high = np.percentile(points, 0.5, axis=0), np.percentile(points, 99.5, axis=0)
    low = np.array([low[0] - margin_m, low[1] - margin_m, support_z_m])
    high = np.array([high[0] + margin_m, high[1] + margin_m, high[2] + headroom_m])
    shape = np.maximum(np.ceil((high - low) / voxel_size_m - 1e-9), 1)
    if shape.prod() > _MAX_VOXELS or shape.max() > 1000:
        extent = " x ".join(f"{v:.1f}" for v in high - low)
        raise InputError(
            f"The objects are spread over {extent} m, too much for voxels of {voxel_size_m} m. Check the depth's unit "
            "and the camera pose, or give a grid."
        )
    return VoxelGrid(low, voxel_size_m, (int(shape[0]), int(shape[1]), int(shape[2])))
