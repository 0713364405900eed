"""Find where the objects stand, from one frame: the support's height and a voxel grid around the objects."""

import cv2
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.geometry.transforms import masked_points, unproject
from torc.perception.embedded.inputs import View, rising
from torc.records import BACKGROUND, Capture, Observation, VoxelGrid

_HORIZONTAL_COS = 0.966
"""Least |z| of a unit normal of a horizontal surface: 15 deg."""
_STEP_PX = 3
"""Normals come from points this far to both sides: nearer ones drown in sensor noise."""
_BIN_M = 0.004
_MIN_POINTS = 100
_BELOW_LOWEST_M = 0.02
"""How far the support may appear above the objects' lowest points (noise, tilt of the camera)."""
_MAX_VOXELS = 4_000_000
_OUTLINE_VOXEL_M = 0.01


def object_points(capture: Capture) -> Float[np.ndarray, "n 3"]:
    """Return world points of all pixels with a depth that show an object, by the labels; without labels, of all."""
    o, label = capture.observation, capture.label_image
    shown = (o.depth_m > 0) & (True if label is None else label >= 0)
    return masked_points(shown, o.depth_m, o.K, o.T_world_camera)


def estimate_support_z_m(capture: Capture) -> float:
    """Estimate the height of the horizontal surface that the objects stand on.

    Background pixels on horizontal surfaces are counted by height. Of the heights with many pixels (the table, perhaps
    the floor, a shelf) the result is the highest that is not above the objects' lowest points. Without labels it is the
    one with most pixels, those in the middle of the picture counting more.

    Raises InputError if too little of any horizontal surface is in sight.
    """
    points, weights = _horizontal_surface(capture)
    heights = points[:, 2]
    if capture.label_image is not None:
        lowest = float(np.percentile(object_points(capture)[:, 2], 1))
        heights = heights[heights < lowest + _BELOW_LOWEST_M]
    if len(heights) < _MIN_POINTS:
        what = "pixels" if capture.label_image is None else "pixels of the background, below the objects,"
        raise InputError(
            f"The height of the support surface cannot be estimated: only {len(heights)} {what} show a horizontal "
            "surface. Give support_z_m; or the camera pose is wrong."
        )
    start = heights.min() - _BIN_M / 2
    bins = ((heights - start) / _BIN_M).astype(int)
    if capture.label_image is None:
        smooth = np.convolve(np.bincount(bins, weights), np.ones(3), "same")
        peak = int(np.argmax(smooth))
    else:
        smooth = np.convolve(np.bincount(bins), np.ones(3), "same")
        peak = int(np.flatnonzero(smooth >= 0.15 * smooth.max())[-1])
        # From the first bin that is high enough, climb down to the top of that peak.
        while peak > 0 and smooth[peak - 1] > smooth[peak]:
            peak -= 1
    center = start + (peak + 0.5) * _BIN_M
    return float(np.median(heights[np.abs(heights - center) < 2.5 * _BIN_M]))


def level_heights(capture: Capture) -> Float[np.ndarray, "n"]:
    """Return world z of the pixels that show a horizontal surface, of the background if there are labels."""
    return _horizontal_surface(capture)[0][:, 2]


def level_share(observation: Observation) -> float:
    """Return the share of the readings that show the largest horizontal surface below the camera."""
    heights = np.sort(level_heights(Capture(observation)))
    heights = heights[heights < observation.T_world_camera[2, 3]]
    if len(heights) == 0:
        return 0.0
    within = np.searchsorted(heights, heights + 5 * _BIN_M) - np.arange(len(heights))
    return float(within.max() / max(np.count_nonzero(observation.depth_m), 1))


def standing_points(observation: Observation, support_z_m: float) -> Float[np.ndarray, "n 3"]:
    """Return world points of what rises from the support, within the support's visible outline.

    Replaces `object_points` without labels.
    """
    points, _ = _horizontal_surface(Capture(observation))
    flat = points[np.abs(points[:, 2] - support_z_m) < 2.5 * _BIN_M]
    if len(flat) < _MIN_POINTS:
        return np.zeros((0, 3))
    low, high = np.percentile(flat[:, :2], 1, axis=0), np.percentile(flat[:, :2], 99, axis=0)
    shape = np.maximum(np.ceil((high - low) / _OUTLINE_VOXEL_M), 1).astype(int)
    outline = VoxelGrid(np.array([*low, support_z_m]), _OUTLINE_VOXEL_M, (int(shape[0]), int(shape[1]), 1))
    view = View(observation.rgb, observation.depth_m, observation.K, observation.T_world_camera, support_z_m)
    return masked_points(rising(view, outline), view.depth_m, view.K, view.T_world_camera)


def _horizontal_surface(capture: Capture) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Return the points that show a horizontal surface, and their weights, which fall towards the picture's edge.

    If there are labels, only the background counts.
    """
    observation, label = capture.observation, capture.label_image
    depth = observation.depth_m
    rows, cols = np.mgrid[: depth.shape[0], : depth.shape[1]]
    points = unproject(rows, cols, depth.astype(float), observation.K, observation.T_world_camera)
    s = _STEP_PX
    across = points[s:-s, 2 * s :] - points[s:-s, : -2 * s]
    down = points[2 * s :, s:-s] - points[: -2 * s, s:-s]
    normal = np.cross(across, down)
    length = np.linalg.norm(normal, axis=-1)
    cross = np.zeros((2 * s + 1, 2 * s + 1), np.uint8)
    cross[s, ::s] = cross[::s, s] = 1
    good = (depth > 0) & ((label == BACKGROUND) if label is not None else True)
    usable = (cv2.erode(good.astype(np.uint8), cross)[s:-s, s:-s] > 0) & (length > 0)
    horizontal = usable & (np.abs(normal[..., 2]) > _HORIZONTAL_COS * length)
    v, u = (2 * (n / (size - 1)) - 1 for n, size in zip((rows, cols), depth.shape))
    weights = np.exp(-2 * (u**2 + v**2))[s:-s, s:-s]
    return points[s:-s, s:-s][horizontal], weights[horizontal]


def grid_around(
    points: Float[np.ndarray, "n 3"],
    support_z_m: float,
    voxel_size_m: float = 0.01,
    margin_m: float = 0.15,
    headroom_m: float = 0.10,
) -> VoxelGrid:
    """Return a grid over the objects' points: its floor on the support, with room around for what they hide.

    Outliers (the outermost half per cent along each axis) do not count. Raises InputError if the objects are spread too
    widely for a grid of that resolution.
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
