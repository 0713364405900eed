"""The space that objects hide, counted in one pass."""

from dataclasses import replace

import numpy as np

from torc.occlusion.volume import hidden_near_m3, hidden_volumes_m3
from torc.testing import contexts


def test_hidden_volumes_are_the_records_own(rng: np.random.Generator) -> None:
    volume = contexts.hidden_context().volume
    masks = rng.integers(0, 2**64, volume.hidden_by.shape, dtype=np.uint64) & rng.integers(
        0, 2**64, volume.hidden_by.shape, dtype=np.uint64
    )
    volume = replace(volume, hidden_by=masks)
    expected = [volume.hidden_volume_m3(k) for k in range(64)]
    np.testing.assert_allclose(hidden_volumes_m3(volume, range(64)), expected, rtol=1e-12)


def test_space_near_points_is_that_of_the_voxels_in_the_box_around_them(rng: np.random.Generator) -> None:
    volume = contexts.hidden_context().volume
    masks = rng.integers(0, 8, volume.hidden_by.shape, dtype=np.uint64)
    volume = replace(volume, hidden_by=masks)
    grid, centers = volume.grid, volume.grid.centers()
    middle, size = 0.5 * (grid.origin + grid.upper), grid.upper - grid.origin
    for center in (middle, grid.origin, grid.upper, grid.upper + 2.0, grid.origin - 2.0):
        points = center + 0.1 * size * rng.uniform(-1, 1, (5, 3))
        low, high = points.min(axis=0) - 0.05, points.max(axis=0) + 0.05
        reached = np.all(
            (centers > low - grid.voxel_size_m / 2) & (centers < high + grid.voxel_size_m / 2), axis=-1
        )
        expected = [
            np.count_nonzero(reached & (masks & np.uint64(1 << k) > 0)) * grid.voxel_size_m**3
            for k in range(3)
        ]
        np.testing.assert_allclose(
            hidden_near_m3(volume, range(3), points, 0.05), expected, rtol=1e-9, atol=1e-15
        )
