"""Nets lose their triangles without area, not their being closed."""

import itertools

import numpy as np
import pytest
from mesh_files import box, enclosed_volume

from torc.scenes.importing.closing import is_closed
from torc.scenes.importing.slivers import flat_faces, without_slivers

SIZE = (0.1, 0.2, 0.3)


def _with_points_on_edges(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """A box with points on its edges that only one side of each edge uses; flat triangles close the gaps."""
    vertices, faces = box(SIZE)
    rows, triangles = list(vertices), [tuple(f) for f in faces.tolist()]
    for _ in range(count):
        k = int(rng.integers(len(triangles)))
        a, b, c = triangles[k]
        share = rng.uniform(0.2, 0.8)
        rows.append((1 - share) * rows[a] + share * rows[b])
        m = len(rows) - 1
        # The point splits this triangle alone: its neighbour still has the whole edge, and a flat one lies between.
        triangles[k : k + 1] = [(a, m, c), (m, b, c), (a, b, m)]
    return np.array(rows), np.array(triangles)


@pytest.mark.parametrize("count", [1, 5, 10])
def test_a_closed_net_stays_closed(count: int, rng: np.random.Generator) -> None:
    vertices, faces = _with_points_on_edges(rng, count)
    assert flat_faces(vertices, faces).any()
    assert is_closed(faces)
    clean = without_slivers(vertices, faces)
    assert not flat_faces(vertices, clean).any()
    assert is_closed(clean)
    assert enclosed_volume(vertices, clean) == pytest.approx(np.prod(SIZE))


def test_a_net_without_slivers_is_the_same() -> None:
    vertices, faces = box(SIZE)
    assert without_slivers(vertices, faces) is faces


def test_slivers_at_an_open_edge_are_left_out() -> None:
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.5, 0, 0)], float)
    faces = np.array([(0, 1, 2), (0, 3, 1)])  # beyond the longest edge of the second lies the first
    clean = without_slivers(vertices, faces)
    assert sorted(map(sorted, clean.tolist())) == [[0, 2, 3], [1, 2, 3]]
    lone = np.array([(0, 1, 3)])
    assert len(without_slivers(vertices, lone)) == 0


def test_sheets_without_area_go_whole() -> None:
    vertices, faces = box(SIZE)
    vertices = np.concatenate([vertices, [(1.0, 0, 0), (1.1, 0, 0), (1.2, 0, 0)]])
    both = np.concatenate([faces, [(8, 9, 10), (8, 10, 9)]])
    clean = without_slivers(vertices, both)
    assert sorted(clean.tolist()) == sorted(faces.tolist())


def test_long_chains_of_slivers_stay_closed() -> None:
    """A fan over 400 points on one edge, as a polygon's first triangles have it."""
    count = 400
    vertices, faces = box(SIZE)
    shares = np.linspace(0.0, 1.0, count + 2)[1:-1, None]
    vertices = np.concatenate([vertices, vertices[0] * (1 - shares) + vertices[1] * shares])
    chain = [0, *range(8, 8 + count), 1]
    first = next(i for i, face in enumerate(faces.tolist()) if {0, 1} <= set(face))
    corners = faces[first].tolist()
    third = next(c for c in corners if c not in (0, 1))
    forward = (corners.index(1) - corners.index(0)) % 3 == 1
    # One triangle at the edge 0-1 has the points on its side: flat ones lie between it and its neighbour.
    split = [(a, b, third) if forward else (b, a, third) for a, b in itertools.pairwise(chain)]
    fan = [(0, a, b) for a, b in itertools.pairwise(chain[1:])]
    flat = [face[::-1] if forward else face for face in fan]
    net = np.concatenate([np.delete(faces, first, axis=0), split, flat])
    assert is_closed(net)
    clean = without_slivers(vertices, net)
    assert is_closed(clean)
    assert not flat_faces(vertices, clean).any()
    assert enclosed_volume(vertices, clean) == pytest.approx(np.prod(SIZE))
