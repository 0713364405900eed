"""Polygons of any number of corners to triangles."""

import numpy as np
from jaxtyping import Float, Int

_FLAT = 1e-12
"""Twice the area at a corner, against the polygon's, below which it counts as straight."""


def triangulated(
    vertices: Float[np.ndarray, "n 3"], lengths: Int[np.ndarray, "k"], corners: Int[np.ndarray, "c"]
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, "m"]]:
    """Triangles that cover polygons, concave ones too, with the polygons' sense of rotation.

    Args:
        vertices: points.
        lengths: corners of each polygon; those with fewer than three have no triangles.
        corners: rows of `vertices`, polygon after polygon.

    Returns:
        The triangles as positions in `corners`, and the polygon of each; in the order of the polygons.
    """
    with np.errstate(all="ignore"):  # corners may be anywhere, and no numbers
        return _triangulated(vertices, lengths, corners)


def _triangulated(
    vertices: np.ndarray, lengths: np.ndarray, corners: np.ndarray
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, "m"]]:
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64) if len(lengths) else lengths
    triangles, owners = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for n in np.unique(lengths[lengths >= 3]):
        which = np.flatnonzero(lengths == n)
        positions = starts[which, None] + np.arange(n)
        fan = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], axis=1)
        convex = _convex(vertices[corners[positions]]) if n > 3 else np.ones(len(which), bool)
        triangles.append(positions[convex][:, fan].reshape(-1, 3))
        owners.append(np.repeat(which[convex], n - 2))
        for polygon, row in zip(which[~convex], positions[~convex]):
            cut = _cut(vertices[corners[row]])
            triangles.append(row[cut])
            owners.append(np.full(len(cut), polygon))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]


def _normals(points: Float[np.ndarray, "k n 3"]) -> Float[np.ndarray, "k 3"]:
    """Newell's: twice the area vector of polygons that need not be flat."""
    from_first = points - points[:, :1]
    return np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1)


def _convex(points: Float[np.ndarray, "k n 3"]) -> np.ndarray:
    """Whether a fan covers a polygon as it should: all its triangles turn as the polygon does."""
    normals = _normals(points)
    from_first = points[:, 1:] - points[:, :1]
    turns = np.cross(from_first[:, :-1], from_first[:, 1:])
    along = np.einsum("kni,ki->kn", turns, normals)
    return np.asarray(~(along < -_FLAT * (normals**2).sum(axis=1)[:, None]).any(axis=1))


def _cut(points: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "m 3"]:
    """Triangles of a polygon that is not convex, by ear clipping in the plane that it lies in best."""
    import mapbox_earcut

    normal = _normals(points[None])[0]
    drop = int(np.argmax(np.abs(normal)))
    u, v = ((1, 2), (2, 0), (0, 1))[drop]
    flat = np.ascontiguousarray(points[:, [u, v]] if normal[drop] > 0 else points[:, [v, u]])
    cut = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32)).reshape(-1, 3)
    cut = cut.astype(np.int64)
    first, second, third = (flat[cut[:, i]] for i in range(3))
    (a, b), (c, d) = (second - first).T, (third - first).T
    return np.where((a * d - b * c < 0)[:, None], cut[:, ::-1], cut)
