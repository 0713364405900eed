"""Fewer triangles show the same shape in the same colours."""

import numpy as np
from mesh_files import box, revolved

from torc.scenes.importing.simplifying import baked, simplified
from torc.scenes.importing.surfaces import Surface
from torc.scenes.models import VisualMesh

RADIUS = 0.05


def _ball(rings: int, sections: int) -> tuple[np.ndarray, np.ndarray]:
    angles = np.linspace(-np.pi / 2, np.pi / 2, rings)[1:-1]
    profile = [(0.0, -RADIUS), *zip(RADIUS * np.cos(angles), RADIUS * np.sin(angles)), (0.0, RADIUS)]
    return revolved(profile, sections)


def _seen(visual: VisualMesh, shares: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A point of every triangle, and the texture's colour there."""
    assert visual.uv is not None
    assert visual.texture is not None
    weights = np.array(shares)[None, :, None]
    points = (visual.vertices[visual.faces] * weights).sum(axis=1)
    uv = (visual.uv[visual.faces] * weights).sum(axis=1)
    h, w = visual.texture.shape[:2]
    at = (uv * (w, h)).astype(int)
    return points, visual.texture[at[:, 1], at[:, 0]]


def test_a_ball_stays_a_ball() -> None:
    vertices, faces = _ball(60, 80)
    points, net = simplified(vertices, faces, 1000)
    assert 500 < len(net) <= 1000
    assert np.abs(np.linalg.norm(points[np.unique(net)], axis=1) - RADIUS).max() < 0.001


def test_small_meshes_are_left_alone() -> None:
    vertices, faces = box((0.1, 0.1, 0.1))
    assert simplified(vertices, faces, 100)[1] is faces


def test_colours_of_vertices_come_through() -> None:
    vertices, faces = _ball(60, 80)
    colours = np.where(vertices[:, 2:] > 0, (200, 30, 30), (30, 30, 200)).astype(np.uint8)
    points, net = simplified(vertices, faces, 1000)
    visual = baked([Surface(vertices, faces, colours=colours)], points, net, 512)
    for shares in ((0.98, 0.01, 0.01), (0.01, 0.98, 0.01), (0.01, 0.01, 0.98), (0.34, 0.33, 0.33)):
        at, seen = _seen(visual, shares)
        clear = np.abs(at[:, 2]) > 0.004
        expected = np.where(at[:, 2:] > 0, (200, 30, 30), (30, 30, 200))
        assert np.abs(seen.astype(int) - expected)[clear].max() <= 2


def test_textures_and_plain_colours_come_through() -> None:
    vertices, faces = box((0.1, 0.1, 0.1))
    texture = np.zeros((64, 64, 3), np.uint8)
    texture[:32] = (250, 250, 0)
    uv = np.stack([vertices[:, 0] / 0.1 + 0.5, 0.5 - vertices[:, 2] / 0.1], axis=1)
    painted = Surface(vertices, faces, uv, texture, (1.0, 1.0, 1.0, 1.0))
    green = Surface(vertices + np.array([0.2, 0.0, 0.0]), faces, rgba=(0.0, 1.0, 0.0, 1.0))
    both = np.concatenate([vertices, green.vertices])
    visual = baked([painted, green], both, np.concatenate([faces, faces + 8]), 512)
    at, seen = _seen(visual, (0.4, 0.35, 0.25))
    for point, colour in zip(at, seen):
        if point[0] > 0.1:
            assert tuple(colour) == (0, 255, 0)
        elif abs(point[2]) > 0.01:
            assert tuple(colour) == ((250, 250, 0) if point[2] > 0 else (0, 0, 0))


def test_colours_of_vertices_tint_a_texture() -> None:
    vertices, faces = box((0.1, 0.1, 0.1))
    texture = np.full((8, 8, 3), (200, 100, 50), np.uint8)
    colours = np.where(vertices[:, 2:] > 0, 255, 128).astype(np.uint8) * np.ones(3, np.uint8)
    surface = Surface(vertices, faces, vertices[:, :2], texture, (0.1, 0.1, 0.1, 1.0), colours)
    at, seen = _seen(baked([surface], vertices, faces, 512), (0.4, 0.35, 0.25))
    top, bottom = at[:, 2] > 0.0499, at[:, 2] < -0.0499
    assert np.abs(seen[top].astype(int) - (200, 100, 50)).max() <= 1
    assert np.abs(seen[bottom].astype(int) - (100, 50, 25)).max() <= 1


def test_triangles_of_a_baked_surface_do_not_share_texels() -> None:
    vertices, faces = _ball(10, 16)
    visual = baked([Surface(vertices, faces)], vertices, faces, 256)
    assert visual.uv is not None
    cell = 256 // int(np.ceil(np.sqrt(len(faces))))
    side = int(np.ceil(np.sqrt(len(faces)))) * cell
    cells = np.floor(visual.uv[visual.faces] * side / cell).astype(int)
    assert (cells == cells[:, :1]).all()
    assert len(np.unique(cells[:, 0], axis=0)) == len(faces)
