"""Fewer triangles, with the colours of all the old surfaces in one new texture."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int, UInt8

from torc.scenes.importing.surfaces import Surface, with_normals
from torc.scenes.models import VisualMesh

_SAMPLES_PER_TEXEL = 1.0
_MAX_SAMPLES = 1_200_000
_MIN_CELL_PX = 4
_AGGRESSIONS = (5.0, 7.0, 10.0)
"""From the truest to the most eager; torn meshes stop the true ones early."""


def simplified(
    vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"], max_faces: int
) -> tuple[Float[np.ndarray, "k 3"], Int[np.ndarray, "l 3"]]:
    """The welded mesh with about max_faces triangles, by quadric edge collapse; as it is if it has no more."""
    if len(faces) <= max_faces:
        return vertices, faces
    import fast_simplification

    # In units of its size: the collapse works with absolute thresholds.
    size = float(np.ptp(vertices, axis=0).max())
    center = vertices.mean(axis=0)
    for aggression in _AGGRESSIONS:
        points, triangles = fast_simplification.simplify(
            (vertices - center) / size, faces.astype(np.int32), target_count=max_faces, agg=aggression
        )
        if len(triangles) <= 1.1 * max_faces:
            break
    return np.asarray(points, float) * size + center, np.asarray(triangles, np.int64)


def baked(
    sources: Sequence[Surface],
    vertices: Float[np.ndarray, "n 3"],
    faces: Int[np.ndarray, "m 3"],
    texture_px: int,
) -> VisualMesh:
    """Triangles with a texture of their own that shows the colours of `sources` where these are nearest.

    Every triangle has a cell of the texture. Cells of neighbours are neighbours, as far as a plane allows, so that
    what a reduced texture mixes is of similar colour.
    """
    split, normals = with_normals(Surface(vertices, faces))
    corners = split.vertices[split.faces]
    side = int(np.ceil(np.sqrt(len(corners))))
    cell = max(_MIN_CELL_PX, texture_px // side)
    where = np.empty((len(corners), 2), np.int64)
    where[np.argsort(_morton(corners.mean(axis=1)), kind="stable")] = _curve(side)[: len(corners)]
    uv = (where[:, None] * cell + _corners_px(cell) + 0.5) / (side * cell)
    texture = _paint(sources, corners, where, side, cell)
    flat = split.faces.reshape(-1)
    return VisualMesh(
        corners.reshape(-1, 3),
        np.arange(3 * len(corners)).reshape(-1, 3),
        uv.reshape(-1, 2),
        texture,
        (1.0, 1.0, 1.0, 1.0),
        normals[flat],
    )


def _corners_px(cell: int) -> Float[np.ndarray, "3 2"]:
    """Pixels of a cell where the triangle's corners lie; a rim of one pixel is left around them."""
    return np.array([(1, 1), (cell - 2, 1), (1, cell - 2)], float)


def _paint(
    sources: Sequence[Surface], corners: np.ndarray, where: np.ndarray, side: int, cell: int
) -> UInt8[np.ndarray, "h w 3"]:
    from scipy.spatial import cKDTree

    texels = side * side * cell * cell
    points, colours = _samples(sources, min(_MAX_SAMPLES, int(_SAMPLES_PER_TEXEL * texels)))
    tree = cKDTree(points)
    v, u = np.meshgrid(np.arange(cell), np.arange(cell), indexing="ij")
    # Shares of the second and third corner; pixels outside of the triangle show its nearest edge.
    b = np.clip((u - 1) / max(cell - 3, 1), 0.0, 1.0)
    c = np.clip((v - 1) / max(cell - 3, 1), 0.0, 1.0)
    over = np.maximum(b + c - 1.0, 0.0) / 2
    shares = np.stack([1 - (b - over) - (c - over), b - over, c - over], axis=-1).reshape(-1, 3)
    texture = np.zeros((side * cell, side * cell, 3), np.uint8)
    for some in np.array_split(np.arange(len(corners)), max(1, len(corners) * len(shares) // 400_000)):
        at = np.einsum("pk,fkd->fpd", shares, corners[some])
        _, nearest = tree.query(at.reshape(-1, 3))
        seen = colours[nearest].reshape(len(some), cell, cell, 3)
        rows = where[some, 1, None, None] * cell + v
        columns = where[some, 0, None, None] * cell + u
        texture[rows, columns] = seen
    return texture


def _samples(sources: Sequence[Surface], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly over the surfaces, and their colours."""
    rng = np.random.default_rng(0)
    areas = []
    for source in sources:
        c = source.vertices[source.faces]
        areas.append(np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1) / 2)
    total = sum(float(a.sum()) for a in areas)
    points, colours = [], []
    for source, area in zip(sources, areas):
        n = int(np.ceil(count * area.sum() / total))
        # As many per triangle as its share says, the fractions by chance; a point in every triangle.
        each = np.maximum(1, np.floor(n * area / area.sum() + rng.random(len(area))).astype(np.int64))
        face = np.repeat(np.arange(len(area)), each)
        r, s = rng.random(len(face)), rng.random(len(face))
        r, s = np.where(r + s > 1, 1 - r, r), np.where(r + s > 1, 1 - s, s)
        shares = np.stack([1 - r - s, r, s], axis=1)
        points.append(np.einsum("nk,nkd->nd", shares, source.vertices[source.faces[face]]))
        colours.append(_colours(source, source.faces[face], shares))
    return np.concatenate(points), np.concatenate(colours)


def _colours(source: Surface, corners: np.ndarray, shares: np.ndarray) -> UInt8[np.ndarray, "n 3"]:
    tint = np.array(source.rgba[:3])
    if source.colours is not None:
        tint = np.einsum("nk,nkd->nd", shares, source.colours[corners] / 255.0)
    if source.texture is None or source.uv is None:
        return np.round(255 * np.broadcast_to(tint, (len(corners), 3))).astype(np.uint8)
    uv = np.einsum("nk,nkd->nd", shares, source.uv[corners])
    uv = np.where((uv < 0.0) | (uv > 1.0), uv % 1.0, uv)  # textures repeat, but 1 is the far edge
    h, w = source.texture.shape[:2]
    column = np.minimum((uv[:, 0] * w).astype(np.int64), w - 1)
    row = np.minimum((uv[:, 1] * h).astype(np.int64), h - 1)
    return np.round(source.texture[row, column] * tint).astype(np.uint8)


def _spread(value: np.ndarray, gap: int) -> np.ndarray:
    """Bits of 10-bit numbers with `gap` zeros between them."""
    out = np.zeros_like(value)
    for bit in range(10):
        out |= ((value >> bit) & 1) << (bit * (gap + 1))
    return out


def _morton(points: np.ndarray) -> np.ndarray:
    """Numbers along a curve through space that keeps neighbours close."""
    low = points.min(axis=0)
    cells = (1023 * (points - low) / max(float(np.ptp(points, axis=0).max()), 1e-12)).astype(np.int64)
    x, y, z = (_spread(cells[:, k], 2) for k in range(3))
    return np.asarray(x | (y << 1) | (z << 2))


def _curve(side: int) -> Int[np.ndarray, "k 2"]:
    """The cells of a square in the order of such a curve through the plane."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(side), np.arange(side)))
    order = np.argsort(_spread(x, 1) | (_spread(y, 1) << 1), kind="stable")
    return np.stack([x[order], y[order]], axis=1)
