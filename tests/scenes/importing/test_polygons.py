"""Triangles of polygons cover what the polygons cover, once, with their sense of rotation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_files import L_OUTLINE, area

from torc.scenes.importing.reading.polygons import triangulated


def _turned(outline: np.ndarray, seed: int) -> np.ndarray:
    """A flat outline anywhere in space."""
    rng = np.random.default_rng(seed)
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.c_[outline, np.zeros(len(outline))] @ R.T + rng.normal(size=3)


def _shoelace(outline: np.ndarray) -> float:
    x, y = outline.T
    return float(abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2)


@pytest.mark.parametrize("start", range(6))
def test_a_concave_polygon_is_covered_once_from_whichever_corner(start: int) -> None:
    outline = np.roll(np.array(L_OUTLINE), start, axis=0)
    for seed, corners in ((0, np.arange(6)), (1, np.arange(6)[::-1])):
        vertices = _turned(outline, seed)
        triangles, owners = triangulated(vertices, np.array([6]), corners)
        assert len(triangles) == 4
        assert (owners == 0).all()
        faces = corners[triangles]
        assert area(vertices, faces) == pytest.approx(_shoelace(outline))
        a, b, c = (vertices[faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        assert np.linalg.norm(normals.sum(axis=0)) / 2 == pytest.approx(
            _shoelace(outline)
        )  # none is turned over


@settings(max_examples=60, deadline=None)
@given(st.integers(4, 24), st.integers(0, 10_000))
def test_any_star_is_covered_once(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, n)) + np.arange(n) * 1e-3
    outline = rng.uniform(0.2, 1.0, n)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if np.diff(np.append(angles, angles[0] + 2 * np.pi)).max() > np.pi:
        return  # the middle lies outside: not simple for sure
    vertices = _turned(outline, seed)
    triangles, _ = triangulated(vertices, np.array([n]), np.arange(n))
    assert area(vertices, triangles) == pytest.approx(_shoelace(outline), rel=1e-6)


def test_polygons_of_all_lengths_stay_in_order(rng: np.random.Generator) -> None:
    vertices = rng.normal(size=(20, 3))
    lengths = np.array([3, 4, 2, 0, 3, 5])
    corners = rng.integers(0, 20, lengths.sum())
    triangles, owners = triangulated(vertices, lengths, corners)
    assert sorted(set(owners.tolist())) == [0, 1, 4, 5]
    assert (np.diff(owners) >= 0).all()
    starts = np.cumsum(lengths) - lengths
    assert ((triangles >= starts[owners, None]) & (triangles < (starts + lengths)[owners, None])).all()
    np.testing.assert_array_equal(triangles[owners == 4], [starts[4] + np.arange(3)])


@pytest.mark.parametrize("points", [np.full((5, 3), np.nan), np.zeros((5, 3)), np.eye(5, 3) * 1e300])
def test_polygons_without_shape_do_no_harm(points: np.ndarray) -> None:
    with np.errstate(all="ignore"):
        triangles, _ = triangulated(points, np.array([5]), np.arange(5))
    assert ((triangles >= 0) & (triangles < 5)).all()


def test_no_polygons_are_no_triangles() -> None:
    triangles, owners = triangulated(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0, np.int64))
    assert triangles.shape == (0, 3)
    assert owners.shape == (0,)
