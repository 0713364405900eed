"""The distance field is exact: compared with the distances to all occupied voxels."""

import numpy as np
import pytest

from torc.collision.distance import distance_field


@pytest.mark.parametrize(
    ("shape", "share"), [((9, 7, 11), 0.05), ((20, 3, 6), 0.01), ((5, 5, 5), 0.6), ((1, 8, 1), 0.2)]
)
def test_distances_are_those_to_the_nearest_occupied_voxel(shape, share):
    rng = np.random.default_rng(7)
    occupied = rng.random(shape) < share
    occupied[tuple(rng.integers(shape))] = True
    cells = np.argwhere(occupied)
    every = np.argwhere(np.ones(shape, dtype=bool))
    nearest = np.linalg.norm(every[:, None] - cells[None], axis=2).min(axis=1).reshape(shape)
    np.testing.assert_allclose(distance_field(occupied, 0.02), 0.02 * nearest, rtol=1e-6)


def test_nothing_is_near_in_an_empty_grid():
    assert distance_field(np.zeros((4, 5, 6), dtype=bool), 0.01).min() > 100
