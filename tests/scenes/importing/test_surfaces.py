"""Cleaning keeps what can be used, and normals are those of the shape."""

import numpy as np
from mesh_files import box, revolved

from torc.scenes.importing.surfaces import Surface, welded, with_area, with_normals, with_sound_faces


def test_unusable_triangles_go_and_the_others_stay(rng: np.random.Generator) -> None:
    vertices, faces = box((0.1, 0.2, 0.3))
    uv = rng.random((8, 2))
    bad_vertices = np.concatenate(
        [vertices, [[np.nan, 0, 0], [np.inf, 0, 0], vertices[0] * 0.5, vertices[0] * 0.25]]
    )
    bad_faces = [
        (0, 1, 8),  # not a number
        (0, 9, 2),  # infinite
        (0, 0, 1),  # a corner twice
        (0, 10, 11),  # on one line
        (0, 1, 99),  # beyond the vertices
        (0, 1, -1),
        (1, 3, 0),  # the first face again, turned
    ]
    surface = Surface(
        bad_vertices, np.array([*bad_faces[:4], *faces, *bad_faces[4:]]), np.vstack([uv, uv[:4]])
    )
    sound, dropped = with_sound_faces(surface)
    clean = with_area(sound)
    assert dropped == len(bad_faces) - 2  # those of the two without area are sound
    assert len(sound.faces) - len(clean.faces) == 2
    assert clean.uv is not None
    np.testing.assert_array_equal(clean.vertices[clean.faces], vertices[faces])
    np.testing.assert_array_equal(clean.uv[clean.faces], uv[faces])


def test_the_two_sides_of_a_sheet_stay() -> None:
    vertices, faces = box((0.1, 0.2, 0.3))
    sheet = np.concatenate([faces[:2], faces[:2, ::-1]])
    assert with_sound_faces(Surface(vertices, sheet))[1] == 0


def test_nothing_usable_is_empty() -> None:
    clean, dropped = with_sound_faces(Surface(np.full((3, 3), np.nan), np.array([[0, 1, 2]])))
    assert (len(clean.faces), dropped) == (0, 1)


def test_welding_joins_what_coincides() -> None:
    vertices, faces = box((0.1, 0.2, 0.3))
    soup = vertices[faces].reshape(-1, 3) + 1e-9
    net_vertices, net = welded(soup, np.arange(36).reshape(-1, 3))
    assert (len(net_vertices), len(net)) == (8, 12)
    np.testing.assert_allclose(net_vertices[net], vertices[faces], atol=1e-8)


def test_edges_of_a_box_stay_sharp() -> None:
    vertices, faces = box((0.1, 0.2, 0.3))
    surface, normals = with_normals(Surface(vertices, faces))
    assert len(surface.vertices) == 24
    c = surface.vertices[surface.faces]
    flat = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    np.testing.assert_allclose(normals[surface.faces], np.repeat(flat[:, None], 3, axis=1), atol=1e-9)


def test_a_ball_is_smooth() -> None:
    angles = np.linspace(-np.pi / 2, np.pi / 2, 25)
    profile = [(0.0, -0.05), *((0.05 * np.cos(a), 0.05 * np.sin(a)) for a in angles[1:-1]), (0.0, 0.05)]
    vertices, faces = revolved(profile, 48)
    surface, normals = with_normals(Surface(vertices, faces))
    assert len(surface.vertices) == len(vertices)
    outwards = surface.vertices / np.linalg.norm(surface.vertices, axis=1, keepdims=True)
    assert (normals * outwards).sum(axis=1).min() > 0.995
