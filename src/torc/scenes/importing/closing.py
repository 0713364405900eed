"""The solid behind a surface: consistent orientation, small holes and missing undersides closed. Welded meshes only."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

_SMALL_HOLE = 0.4
"""Holes whose rim is shorter than this times the largest extent are closed."""
_UNDERSIDE = 0.04
"""An opening counts as underside if its whole rim is lower than this share of the height."""


@dataclass(frozen=True, eq=False)
class Net:
    """A welded mesh.

    Attributes:
        vertices, faces: the triangles.
        closed: every edge joins two triangles, and all face outwards: there is an inside.
        turned: the file's triangles faced inwards; here they face outwards.
        closed_holes: how many holes were closed.
    """

    vertices: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    closed: bool
    turned: bool
    closed_holes: int


def closed_net(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> Net:
    """The mesh with its triangles turned the same way, and its holes closed where that is surely meant."""
    oriented = _one_way(faces)
    consistent = bool((oriented == faces).all())
    vertices, oriented, holes = _close_holes(vertices, oriented)
    if not is_closed(oriented):
        return Net(vertices, oriented, False, False, holes)
    if not consistent:
        # What faces inwards cannot be told from a cavity here: every part becomes a solid.
        return Net(vertices, _outwards(vertices, oriented), True, False, holes)
    inwards = signed_volume(vertices, oriented) < 0
    return Net(vertices, oriented[:, ::-1] if inwards else oriented, True, inwards, holes)


def _outwards(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    turned = [
        part if signed_volume(vertices, part) > 0 else part[:, ::-1] for part in parts(len(vertices), faces)
    ]
    return np.concatenate(turned)


def signed_volume(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> float:
    """Volume inside a closed mesh; negative if its triangles face inwards."""
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    return float(np.einsum("nd,nd->n", a, np.cross(b, c)).sum() / 6)


def parts(vertex_count: int, faces: Int[np.ndarray, "m 3"]) -> list[Int[np.ndarray, "k 3"]]:
    """Faces of each connected part, largest number of faces first."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    i, j = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    graph = coo_array((np.ones(len(i), np.int8), (i, j)), shape=(vertex_count, vertex_count))
    _, label = connected_components(graph, directed=False)
    of_face = label[faces[:, 0]]
    names, counts = np.unique(of_face, return_counts=True)
    return [faces[of_face == names[k]] for k in np.argsort(-counts, kind="stable")]


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directed edges (3m, 2) and the face of each."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), np.repeat(np.arange(len(faces)), 3)


def is_closed(faces: np.ndarray) -> bool:
    """Every directed edge occurs once and has its opposite."""
    edges, _ = _edges(faces)
    n = int(faces.max()) + 1
    there, back = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    return len(np.unique(there)) == len(there) and bool(np.array_equal(np.sort(there), np.sort(back)))


def _one_way(faces: np.ndarray) -> np.ndarray:
    """Faces turned so that neighbours agree, as far as they can: each part like its first face."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    edges, owner = _edges(faces)
    n = int(faces.max()) + 1
    low, high = edges.min(axis=1), edges.max(axis=1)
    forward = edges[:, 0] == low
    order = np.argsort(low * n + high, kind="stable")
    key = (low * n + high)[order]
    same = np.flatnonzero(key[1:] == key[:-1])
    # Only edges of exactly two faces say something about orientation.
    if len(same):
        lone = np.r_[True, np.diff(same) > 1] & np.r_[np.diff(same) > 1, True]
        same = same[lone]
    a, b = owner[order[same]], owner[order[same + 1]]
    clash = forward[order[same]] == forward[order[same + 1]]
    if not clash.any():
        return faces
    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(len(faces), len(faces))).tocsr()
    clashing = {pair for pair, odd in zip(zip(a.tolist(), b.tolist()), clash.tolist()) if odd}
    _, label = connected_components(graph, directed=False)
    flip = np.zeros(len(faces), bool)
    _, first = np.unique(label, return_index=True)
    for start in first:
        visited, before = breadth_first_order(graph, start, directed=False)
        for face in visited[1:].tolist():
            parent = int(before[face])
            odd = (parent, face) in clashing or (face, parent) in clashing
            flip[face] = flip[parent] ^ odd
    return np.where(flip[:, None], faces[:, ::-1], faces)


def _close_holes(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Fans over small holes and over openings of the underside; other openings (a cup's mouth) stay."""
    extent, low = np.ptp(vertices, axis=0), float(vertices[:, 2].min())
    closed = 0
    for rim in _rims(faces):
        points = vertices[rim]
        length = float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum())
        below = bool((points[:, 2] < low + _UNDERSIDE * extent[2]).all())
        if below or length < _SMALL_HOLE * float(extent.max()):
            hub = len(vertices)
            vertices = np.concatenate([vertices, points.mean(axis=0)[None]])
            # The rim runs along the open edges' faces; the fan runs the other way.
            fan = np.stack([np.roll(rim, -1), rim, np.full(len(rim), hub)], axis=1)
            faces = np.concatenate([faces, fan])
            closed += 1
    return vertices, faces, closed


def _rims(faces: np.ndarray) -> list[np.ndarray]:
    """Loops of open edges that cross no other loop."""
    edges, _ = _edges(faces)
    n = int(faces.max()) + 1
    open_ = edges[~np.isin(edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0])]
    starts, counts = np.unique(open_[:, 0], return_counts=True)
    crossing = set(starts[counts > 1].tolist())
    follow = {int(a): int(b) for a, b in open_}
    rims = []
    while follow:
        start, at = next(iter(follow.items()))
        loop = [start]
        del follow[start]
        while at in follow:
            loop.append(at)
            at = follow.pop(at)
        if at == start and len(loop) >= 3 and not crossing.intersection(loop):
            rims.append(np.array(loop))
    return rims
