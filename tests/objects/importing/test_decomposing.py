"""Convex things stay exact, hollow ones stay hollow."""

import numpy as np
import pytest
from mesh_files import MUG, SIZE, box, revolved
from scipy.spatial import ConvexHull

from torc.objects.importing.decomposing import convex_pieces, few_corners, reduced_hull


def _contains(hulls: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    planes = [ConvexHull(h).equations for h in hulls]
    return np.any([(points @ e[:, :3].T + e[:, 3] <= 1e-9).all(axis=1) for e in planes], axis=0)


def test_a_box_is_itself() -> None:
    (hull,) = convex_pieces(box(SIZE), 0.05, 24)
    corners = box(SIZE).vertices
    np.testing.assert_array_equal(hull[np.lexsort(hull.T)], corners[np.lexsort(corners.T)])


def test_a_mug_stays_hollow() -> None:
    mug = revolved(MUG, 12)
    hulls = convex_pieces(mug, 0.1, 12)
    z = np.linspace(0.012, 0.085, 20)
    assert not _contains(hulls, np.stack([0 * z, 0 * z, z], axis=1)).any()
    assert _contains(hulls, np.array([[0.0, 0.0, 0.003]])).all()
    points = np.concatenate(hulls)
    np.testing.assert_allclose((points.min(axis=0), points.max(axis=0)), mug.bounds, atol=1e-9)


@pytest.mark.parametrize("count", [16, 64])
def test_reduced_hulls_lie_within_and_keep_the_bounding_box(count: int, rng: np.random.Generator) -> None:
    points = rng.normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for scale in ((1.0, 1.0, 1.0), (1.0, 0.5, 0.05)):
        corners = reduced_hull(points * scale, count)
        assert len(corners) <= count
        np.testing.assert_allclose(corners.min(axis=0), (points * scale).min(axis=0))
        np.testing.assert_allclose(corners.max(axis=0), (points * scale).max(axis=0))
        share = ConvexHull(corners).volume / ConvexHull(points * scale).volume
        assert {16: 0.5, 64: 0.84}[count] < share <= 1.0
    assert [len(h) for h in few_corners([points] * 24)] == [64] * 24
