"""Find the part of a picture that may show objects: what rises from the support within the region of interest."""

import cv2
import numpy as np
from jaxtyping import Bool, Float

from torc.geometry.transforms import masked_points
from torc.perception.embedded.inputs import PIXEL_M, View, Window
from torc.records import VoxelGrid

_LEAST_M, _MOST_M = 0.004, 0.6
"""Range of heights above the support at which something can be an object."""
NOISE = 3.0
"""What rises less than this many times the support's own roughness is not an object."""
_SUPPORT_M = 0.015
_RIM_M = 0.05
_MOST_PX = 420_000
"""Most pixels of a patch: larger ones are scaled down further."""
_LEAST_SIDE_PX = 96


def window_on(view: View, grid: VoxelGrid, multiple_px: int) -> tuple[Window, int, int] | None:
    """Return where to cut a patch, and its height and width, multiples of `multiple_px`; None if nothing rises.

    Objects stand within the grid's outline.
    """
    rises = rising(view, grid)
    if not rises.any():
        return None
    scale = float(np.median(view.depth_m[rises])) / (min(view.K[0, 0], view.K[1, 1]) * PIXEL_M)
    rim = _RIM_M / PIXEL_M / scale
    spans = []
    for axis, size in ((1, rises.shape[0]), (0, rises.shape[1])):
        there = np.flatnonzero(rises.any(axis=axis))
        spans.append((max(int(there[0] - rim), 0), min(int(there[-1] + rim) + 1, size)))
    (top, bottom), (left, right) = spans
    area = (bottom - top) * (right - left) * scale**2
    scale *= float(min(1.0, np.sqrt(_MOST_PX / area)))
    height, width = (
        max(int(np.ceil(n * scale / multiple_px)), -(-_LEAST_SIDE_PX // multiple_px)) * multiple_px
        for n in (bottom - top, right - left)
    )
    return Window(top, left, scale), height, width


def rising(view: View, grid: VoxelGrid) -> Bool[np.ndarray, "h w"]:
    """Return the pixels of what rises from the support within the grid's outline, without single ones."""
    read = view.depth_m > 0
    points = masked_points(read, view.depth_m, view.K, view.T_world_camera)
    inside = ((points[:, :2] >= grid.origin[:2]) & (points[:, :2] <= grid.upper[:2])).all(axis=1)
    height = points[:, 2] - view.support_z_m
    least = max(_LEAST_M, NOISE * support_roughness(height[inside]))
    mask = np.zeros(view.depth_m.shape, np.uint8)
    mask[read] = inside & (height > least) & (height < _MOST_M)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0)


def support_roughness(height: Float[np.ndarray, "n"]) -> float:
    """Return the standard deviation of what lies flat, by the median; `height` is above the support, metres."""
    flat = np.abs(height[np.abs(height) < _SUPPORT_M])
    return 1.48 * float(np.median(flat)) if len(flat) else 0.0
