"""Find what the right camera of a stereo pair sees.

A reading is a point that both cameras saw, so nothing lies between it and either of them. That matters most beside near
objects: there is a strip that only the left camera sees. It has no reading, and all of its rays would count as unseen.
The right camera looks through most of that space; what lies behind is hidden from it by the near object.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float32, Int32, UInt64
from numba import njit

from torc.geometry.transforms import invert, kernel_array
from torc.occlusion.projection_kernels import FREE, project_voxels
from torc.records import Observation, VoxelGrid


class RightView(NamedTuple):
    """Per voxel whether the right camera saw through it, and the bits of what hides it from that camera."""

    free: Bool[np.ndarray, "nx ny nz"]
    bits: UInt64[np.ndarray, "nx ny nz"]


def right_view(
    grid: VoxelGrid,
    view: Observation,
    readings: Float32[np.ndarray, "h w"],
    pixel_bits: UInt64[np.ndarray, "h w"],
    baseline_m: float,
    max_depth_m: float,
) -> RightView:
    """Return what the right camera of a view's stereo pair sees.

    Args:
        grid: where the voxels are.
        view: of the left camera.
        readings: its depth in metres, 0 for none; made from the pair.
        pixel_bits: of the object that each of its pixels shows.
        baseline_m: distance of the two cameras.
        max_depth_m: a larger reading means free space as far as this.
    """
    K = kernel_array(view.K)
    T_right_world = invert(view.T_world_camera)
    T_right_world[0, 3] -= baseline_m
    depth_m, source = _to_right(readings, float(K[0, 0]) * baseline_m)
    bits = np.where(source >= 0, pixel_bits.ravel()[source], np.uint64(0))
    state, hidden_by, _ = project_voxels(
        grid.shape,
        kernel_array(grid.origin),
        float(grid.voxel_size_m),
        kernel_array(T_right_world),
        K,
        np.minimum(depth_m, np.float32(max_depth_m)),
        bits,
        np.zeros(depth_m.shape, np.bool_),
        0.0,
    )
    return RightView(state == FREE, hidden_by)


@njit(cache=True)
def _to_right(
    depth: Float32[np.ndarray, "h w"], focal_times_baseline: float
) -> tuple[Float32[np.ndarray, "h w"], Int32[np.ndarray, "h w"]]:
    """Return the nearest reading within a pixel of each right pixel (0: none), and the left pixel it is of (-1: none).

    Within a pixel: near things become a little wider, and what lies behind them never shows through.
    """
    height, width = depth.shape
    right = np.zeros((height, width), np.float32)
    source = np.full((height, width), -1, np.int32)
    for row in range(height):
        for col in range(width):
            d = depth[row, col]
            if d == 0:
                continue
            shown = int(np.floor(col - focal_times_baseline / d + 0.5))
            for r in range(max(row - 1, 0), min(row + 2, height)):
                for c in range(max(shown - 1, 0), min(shown + 2, width)):
                    if right[r, c] == 0 or d < right[r, c]:
                        right[r, c], source[r, c] = d, row * width + col
    return right, source
