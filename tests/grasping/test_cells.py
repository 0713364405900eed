"""Laws of thinning out and grouping points."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torc.grasping.cells import gather, group, thin_out


def test_thinned_points_are_the_means_of_their_cubes(rng):
    points, normals = rng.uniform(-0.1, 0.1, (3000, 3)), rng.normal(size=(3000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    thin, thin_normals = thin_out(points, normals, 0.02)
    cubes = np.floor(points / 0.02).astype(int)
    expected = {tuple(c): points[np.all(cubes == c, axis=1)].mean(axis=0) for c in np.unique(cubes, axis=0)}
    assert len(thin) == len(expected)
    for p in thin:
        assert np.allclose(p, expected[tuple(np.floor(p / 0.02).astype(int))])
    assert np.allclose(np.linalg.norm(thin_normals, axis=1), 1.0)


def test_normals_are_not_averaged_across_an_edge():
    points = np.array([[0.001, 0.001, 0.001], [0.002, 0.002, 0.002]])
    normals = np.array([[1.0, 0, 0], [0, 0, 1.0]])
    _, thin_normals = thin_out(points, normals, 0.01)
    assert any(np.allclose(thin_normals[0], n) for n in normals)


def test_grouping_keeps_every_point_with_its_tag_and_bounds_each_cell(rng):
    points, tags = rng.uniform(0, 0.2, (500, 3)), rng.integers(0, 9, 500)
    cells = group(points, tags, 0.03)
    assert sorted(cells.order) == list(range(500))
    assert np.array_equal(cells.points, points[cells.order])
    assert np.array_equal(cells.tags, tags[cells.order])
    for c, (a, b) in enumerate(zip(cells.starts[:-1], cells.starts[1:])):
        assert b > a
        assert np.all(np.linalg.norm(cells.points[a:b] - cells.centers[c], axis=1) <= cells.radii[c] + 1e-12)


@pytest.mark.parametrize("n", [0, 1, 800])
def test_gather_finds_exactly_the_points_in_the_box(rng, n):
    cells = group(rng.uniform(-0.2, 0.2, (n, 3)), np.zeros(n, dtype=np.int64), 0.04)
    R, tip = Rotation.from_euler("xyz", (0.3, -0.8, 2.0)).as_matrix(), np.array([0.03, -0.02, 0.05])
    box = np.array([[-0.05, -0.02, -0.12], [0.05, 0.04, 0.01]])
    local, index = np.empty((n, 3)), np.empty(n, dtype=np.int64)
    count = gather(R, tip, box, cells, local, index)
    expected = (cells.points - tip) @ R
    inside = np.all((expected >= box[0]) & (expected <= box[1]), axis=1)
    assert sorted(index[:count]) == np.flatnonzero(inside).tolist()
    assert np.allclose(local[:count], expected[index[:count]])
