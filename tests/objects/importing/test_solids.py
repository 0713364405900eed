"""Solids are closed where that is surely meant, keep their looks when simplified, and fall into convex pieces."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mesh_files import MUG, SIZE, box, revolved, two_tone
from scipy.spatial import ConvexHull

from torc.objects.importing.baking import baked
from torc.objects.importing.decomposing import convex_pieces, few_corners, reduced_hull
from torc.objects.importing.surfaces import Surface, shaded, simplified, solid


def without(mesh: trimesh.Trimesh, *faces: int) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, np.delete(mesh.faces, faces, axis=0), process=False)


def test_what_faces_inwards_is_turned_as_a_whole() -> None:
    cavity = trimesh.util.concatenate([box(SIZE), box(np.array(SIZE) / 2)])
    cavity.faces[12:] = cavity.faces[12:, ::-1]
    volume = cavity.volume
    cavity.invert()
    found = solid(cavity)
    assert (found.closed, found.turned) == (True, True)
    assert found.net.volume == pytest.approx(volume)


def test_small_holes_and_undersides_are_closed_and_mouths_are_not() -> None:
    mug = revolved([*MUG[:2], (0.04, 0.03), (0.04, 0.038), *MUG[2:]], 24)
    z, within = mug.triangles_center[:, 2], np.ptp(mug.triangles[:, :, 2], axis=1) < 0.05
    walls = np.flatnonzero((z > 0.03) & (z < 0.038) & within)[[0, 30]]
    found = solid(without(mug, *np.flatnonzero(z < 1e-6), *walls))
    assert (found.closed, found.closed_holes) == (True, 3)
    assert found.net.volume == pytest.approx(mug.volume, rel=0.02)
    outside = revolved(MUG[:3], 24)
    assert (solid(outside).closed, solid(outside).closed_holes) == (False, 0)


def test_normals_are_smooth_but_for_sharp_edges() -> None:
    can = shaded(Surface(*_arrays(revolved([(0.0, 0.0), (0.03, 0.0), (0.03, 0.1), (0.0, 0.1)], 24))))
    assert can.normals is not None
    side = np.abs(can.normals[:, 2]) < 0.5
    np.testing.assert_allclose(np.abs(can.normals[~side]), [(0, 0, 1)] * (~side).sum(), atol=1e-9)
    out = can.vertices[side] * (1, 1, 0) / 0.03
    np.testing.assert_allclose(can.normals[side], out, atol=0.05)
    assert len(shaded(Surface(*_arrays(box(SIZE)))).vertices) == 24


def _arrays(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return np.array(mesh.vertices), np.array(mesh.faces)


@pytest.mark.parametrize("by_picture", [True, False])
def test_baked_colors_are_those_of_the_nearest_surface(by_picture: bool) -> None:
    ball = trimesh.creation.icosphere(4, 0.05)
    surface = Surface(*_arrays(ball))
    upper = ball.vertices[:, 2:] > 0
    if by_picture:
        uv = np.stack([np.full(len(upper), 0.5), 1.5 - ball.vertices[:, 2] / 0.1], axis=1)
        surface = replace(surface, uv=uv, texture=np.asarray(two_tone()), rgba=(0.5, 1.0, 1.0, 1.0))
    else:
        surface = replace(surface, colors=np.where(upper, (110, 0, 0), (0, 0, 220)).astype(np.uint8))
    few = simplified(ball, 800)
    found = baked([surface], Surface(*_arrays(few)), 512)
    assert found.texture is not None
    assert found.uv is not None
    size = np.array(found.texture.shape[1::-1])
    for corners, uv in zip(found.vertices[found.faces], found.uv[found.faces]):
        z = corners[:, 2].mean()
        column, row = (uv.mean(axis=0) * size).astype(int)
        if abs(z) > 0.008:
            assert found.texture[row, column].tolist() == ([110, 0, 0] if z > 0 else [0, 0, 220])


def _contains(hulls: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    planes = [ConvexHull(h).equations for h in hulls]
    return np.any([(points @ e[:, :3].T + e[:, 3] <= 1e-9).all(axis=1) for e in planes], axis=0)


def test_a_box_is_itself() -> None:
    (hull,) = convex_pieces(box(SIZE), 0.05, 24)
    corners = box(SIZE).vertices
    np.testing.assert_array_equal(hull[np.lexsort(hull.T)], corners[np.lexsort(corners.T)])


@pytest.mark.long
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
