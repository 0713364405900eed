"""Convex things stay exact, hollow ones stay hollow."""

from pathlib import Path

import numpy as np
import pytest
from mesh_files import MUG, box, revolved
from scipy.spatial import ConvexHull

from torc.scenes.importing.decomposing import (
    MAX_HULL_VERTICES,
    NET_FILE,
    convex_pieces,
    decompose,
    read_hulls,
)
from torc.scenes.importing.hulls import reduced_hull, solid_enough, thinned

SIZE = (0.06, 0.16, 0.21)


def _contains(hulls: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    planes = [ConvexHull(h).equations for h in hulls]
    return np.any([(points @ e[:, :3].T + e[:, 3] <= 1e-9).all(axis=1) for e in planes], axis=0)


def test_a_box_is_itself() -> None:
    (hull,) = convex_pieces(*box(SIZE), 0.05, 24)
    np.testing.assert_array_equal(hull[np.lexsort(hull.T)], box(SIZE)[0][np.lexsort(box(SIZE)[0].T)])


@pytest.mark.slow
def test_a_box_without_its_top_and_bottom_is_a_tube_not_a_box() -> None:
    vertices, faces = box(SIZE)
    wavy = convex_pieces(vertices, faces[:8], 0.05, 8)
    assert not _contains(wavy, np.zeros((1, 3)))[0]


def test_an_open_net_that_lies_on_its_hull_is_convex() -> None:
    vertices, faces = revolved([(0.0, 0.0), (0.03, 0.0), (0.03, 0.1), (0.0, 0.1)], 32)
    assert len(convex_pieces(vertices, np.delete(faces, [3, 40, 41], axis=0), 0.05, 24)) == 1


def test_separate_convex_parts_are_exact() -> None:
    vertices, faces = box(SIZE)
    both = np.concatenate([vertices, 0.5 * vertices + (0.2, 0.0, 0.0)])
    hulls = convex_pieces(both, np.concatenate([faces, faces + 8]), 0.05, 24)
    assert sorted(ConvexHull(h).volume for h in hulls) == pytest.approx([np.prod(SIZE) / 8, np.prod(SIZE)])


def test_a_cavity_inside_is_no_piece() -> None:
    vertices, faces = box(SIZE)
    both = np.concatenate([vertices, 0.5 * vertices])
    assert len(convex_pieces(both, np.concatenate([faces, faces[:, ::-1] + 8]), 0.05, 24)) == 1


def test_a_mug_stays_hollow() -> None:
    vertices, faces = revolved(MUG, 12)
    hulls = convex_pieces(vertices, faces, 0.1, 12)
    z = np.linspace(0.012, 0.085, 20)
    assert not _contains(hulls, np.stack([0 * z, 0 * z, z], axis=1)).any()
    assert _contains(hulls, np.array([[0.0, 0.0, 0.003]])).all()
    points = np.concatenate(hulls)
    np.testing.assert_allclose(points.min(axis=0), vertices.min(axis=0), atol=1e-9)
    np.testing.assert_allclose(points.max(axis=0), vertices.max(axis=0), atol=1e-9)


def test_the_same_net_gives_the_same_pieces() -> None:
    vertices, faces = revolved(
        [(0.0, 0.0), (0.05, 0.0), (0.05, 0.02), (0.02, 0.02), (0.02, 0.08), (0.0, 0.08)], 6
    )
    first, second = (convex_pieces(vertices, faces, 0.05, 8) for _ in range(2))
    assert len(first) >= 2
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("count", [8, 16, 64])
def test_reduced_hulls_lie_within_and_keep_the_bounding_box(count: int, rng: np.random.Generator) -> None:
    points = rng.normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    corners = reduced_hull(points, count)
    assert len(corners) <= count
    np.testing.assert_allclose(corners.min(axis=0), points.min(axis=0))
    np.testing.assert_allclose(corners.max(axis=0), points.max(axis=0))
    share = ConvexHull(corners).volume / ConvexHull(points).volume
    assert {8: 0.3, 16: 0.55, 64: 0.85}[count] < share <= 1.0


def test_a_piece_that_is_too_fine_is_thinned_not_refused(tmp_path: Path) -> None:
    """A ball of 20,000 corners goes through the child's file, and stays a ball."""
    vertices, faces = revolved(
        [(0.05 * np.sin(a), -0.05 * np.cos(a)) for a in np.linspace(0, np.pi, 100)], 200
    )
    assert len(vertices) > 4 * MAX_HULL_VERTICES
    np.savez(tmp_path / NET_FILE, contact_vertices=vertices, contact_faces=faces.astype(np.int32))
    answer = decompose({"concavity": 0.05, "max_pieces": 24}, tmp_path)
    (hull,) = read_hulls(answer["hulls"], tmp_path)
    assert 1000 < len(hull) <= MAX_HULL_VERTICES
    np.testing.assert_allclose(hull.min(axis=0), vertices.min(axis=0), atol=1e-9)
    np.testing.assert_allclose(hull.max(axis=0), vertices.max(axis=0), atol=1e-9)
    assert ConvexHull(hull).volume > 0.99 * ConvexHull(vertices).volume
    assert thinned(hull, MAX_HULL_VERTICES) is hull


def test_slivers_are_no_pieces() -> None:
    vertices, _ = box(SIZE)
    assert solid_enough(vertices)
    assert not solid_enough(vertices * (1, 1, 1e-3))
    assert not solid_enough(vertices * (1, 1, 0))
    assert not solid_enough(vertices * 0.005)
