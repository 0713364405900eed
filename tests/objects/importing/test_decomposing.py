"""Convex things stay exact, hollow ones stay hollow."""

import numpy as np
import pytest
import trimesh
from mesh_files import MUG, SIZE, box, revolved
from scipy.spatial import ConvexHull

from torc.objects.importing.decomposing import convex_pieces, few_corners, reduced_hull, solid_enough


def _contains(hulls: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    planes = [ConvexHull(h).equations for h in hulls]
    return np.any([(points @ e[:, :3].T + e[:, 3] <= 1e-9).all(axis=1) for e in planes], axis=0)


def test_a_box_is_itself() -> None:
    (hull,) = convex_pieces(box(SIZE), 0.05, 24)
    corners = box(SIZE).vertices
    np.testing.assert_array_equal(hull[np.lexsort(hull.T)], corners[np.lexsort(corners.T)])


@pytest.mark.slow
def test_a_box_without_its_top_and_bottom_is_a_tube_not_a_box() -> None:
    tube = box(SIZE)
    tube.update_faces(np.abs(tube.face_normals[:, 2]) < 0.5)
    assert not _contains(convex_pieces(tube, 0.05, 8), np.zeros((1, 3)))[0]


def test_an_open_net_that_lies_on_its_hull_is_convex() -> None:
    can = revolved([(0.0, 0.0), (0.03, 0.0), (0.03, 0.1), (0.0, 0.1)], 32)
    can.update_faces(~np.isin(np.arange(len(can.faces)), [3, 40, 41]))
    assert len(convex_pieces(can, 0.05, 24)) == 1


def test_separate_convex_parts_are_exact() -> None:
    both = trimesh.util.concatenate([box(SIZE), box(np.array(SIZE) / 2).apply_translation((0.2, 0, 0))])
    hulls = convex_pieces(both, 0.05, 24)
    assert sorted(ConvexHull(h).volume for h in hulls) == pytest.approx([np.prod(SIZE) / 8, np.prod(SIZE)])


def test_a_cavity_inside_is_no_piece() -> None:
    inside = box(np.array(SIZE) / 2)
    inside.invert()
    assert len(convex_pieces(trimesh.util.concatenate([box(SIZE), inside]), 0.05, 24)) == 1


def test_a_mug_stays_hollow() -> None:
    mug = revolved(MUG, 12)
    hulls = convex_pieces(mug, 0.1, 12)
    z = np.linspace(0.012, 0.085, 20)
    assert not _contains(hulls, np.stack([0 * z, 0 * z, z], axis=1)).any()
    assert _contains(hulls, np.array([[0.0, 0.0, 0.003]])).all()
    points = np.concatenate(hulls)
    np.testing.assert_allclose((points.min(axis=0), points.max(axis=0)), mug.bounds, atol=1e-9)


def test_faces_without_area_are_in_nobodys_way() -> None:
    """A stool whose edges were split on one side only, and the gaps filled with flat triangles."""
    stool = revolved([(0.0, 0.0), (0.05, 0.0), (0.05, 0.02), (0.02, 0.02), (0.02, 0.08), (0.0, 0.08)], 6)
    vertices, faces = list(stool.vertices), []
    for k, (a, b, c) in enumerate(stool.faces.tolist()):
        if k % 3 == 0:
            faces += [(a, len(vertices), c), (len(vertices), b, c), (a, b, len(vertices))]
            vertices.append((stool.vertices[a] + stool.vertices[b]) / 2)
        else:
            faces.append((a, b, c))
    split = trimesh.Trimesh(vertices, faces, process=False)
    assert split.is_volume
    first, second = (convex_pieces(split, 0.05, 8) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))  # and always the same
    assert sum(ConvexHull(h).volume for h in first) == pytest.approx(stool.volume, rel=0.05)


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


def test_slivers_are_no_pieces() -> None:
    vertices = np.asarray(box(SIZE).vertices)
    assert solid_enough(vertices)
    for scale in ((1, 1, 1e-3), (1, 1, 0), (0.005, 0.005, 0.005)):
        assert not solid_enough(vertices * scale)
