"""Distances to the nearest occupied voxel."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from torc.collision.distances import distance_field


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


@pytest.mark.parametrize(("shape", "count"), [((31, 47, 20), 1), ((60, 20, 35), 40), ((24, 25, 26), 4000)])
def test_distances_are_bit_for_bit_those_of_scipy_with_any_number_of_threads(monkeypatch, shape, count):
    occupied = np.zeros(shape, dtype=bool)
    occupied[tuple(np.random.default_rng(count).integers(np.array(shape)[:, None], size=(3, count)))] = True
    expected = np.asarray(0.01 * distance_transform_edt(~occupied), dtype=np.float32)
    for threads in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        np.testing.assert_array_equal(distance_field(occupied, 0.01), expected)
