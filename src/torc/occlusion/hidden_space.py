"""How much space each object hides: where a target that nobody has seen may be."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.geometry.arrays import kernel_array
from torc.records import OcclusionVolume


def hidden_volumes_m3(volume: OcclusionVolume, ids: Iterable[int]) -> Float[np.ndarray, "n"]:
    """OcclusionVolume.hidden_volume_m3 of many objects in one pass."""
    counts = _count_bits(kernel_array(volume.hidden_by, np.uint64).ravel())
    return counts[list(ids)] * volume.grid.voxel_size_m**3


def hidden_near_m3(
    volume: OcclusionVolume, ids: Iterable[int], points: Float[np.ndarray, "n 3"], reach_m: float
) -> Float[np.ndarray, "k"]:
    """The same, of the space in the box around some points (world frame) that is larger by `reach_m` all around."""
    low = np.maximum(volume.grid.index_of(points.min(axis=0) - reach_m), 0)
    high = np.maximum(volume.grid.index_of(points.max(axis=0) + reach_m) + 1, 0)
    box = tuple(slice(a, b) for a, b in zip(low.tolist(), high.tolist()))
    counts = _count_bits(kernel_array(volume.hidden_by[box], np.uint64).ravel())
    return counts[list(ids)] * volume.grid.voxel_size_m**3


@njit(cache=True)
def _count_bits(masks):
    """How many of the masks have each bit set."""
    counts = np.zeros(64, np.int64)
    for mask in masks:
        bit = 0
        while mask != np.uint64(0):
            if mask & np.uint64(1):
                counts[bit] += 1
            mask >>= np.uint64(1)
            bit += 1
    return counts
