"""Bake the colours of many surfaces into one new texture."""

from collections.abc import Sequence

import numpy as np
import trimesh
from jaxtyping import Float, UInt8
from scipy.spatial import cKDTree

from torc.objects.importing.surfaces import Surface, shaded
from torc.objects.models import VisualMesh

_MAX_SAMPLES = 1_200_000
_MIN_CELL_PX = 4


def baked(sources: Sequence[Surface], net: Surface, texture_px: int) -> VisualMesh:
    """Return a net's triangles with their own texture, showing the colours of `sources` where these are nearest.

    Every triangle has a cell of the texture. Cells of neighbours are neighbours, as far as a plane allows, so that a
    reduced texture mixes similar colours.
    """
    plain = shaded(net)
    assert plain.normals is not None
    corners = plain.vertices[plain.faces]
    side = int(np.ceil(np.sqrt(len(corners))))
    cell = max(_MIN_CELL_PX, texture_px // side)
    x, y = (a.ravel() for a in np.meshgrid(np.arange(side), np.arange(side)))
    cells = np.stack([x, y], axis=1)[np.argsort(_interleaved(x, y), kind="stable")]
    where = np.empty((len(corners), 2), np.int64)
    where[np.argsort(_along_curve(corners.mean(axis=1)), kind="stable")] = cells[: len(corners)]
    # Pixels of a cell where the triangle's corners lie, with a rim of one pixel around them.
    own_px = np.array([(1, 1), (cell - 2, 1), (1, cell - 2)], float)
    uv = (where[:, None] * cell + own_px + 0.5) / (side * cell)
    return VisualMesh(
        corners.reshape(-1, 3),
        np.arange(3 * len(corners)).reshape(-1, 3),
        uv.reshape(-1, 2),
        _paint(sources, corners, where, side, cell),
        (1.0, 1.0, 1.0, 1.0),
        plain.normals[plain.faces.ravel()],
    )


def _paint(
    sources: Sequence[Surface], corners: np.ndarray, where: np.ndarray, side: int, cell: int
) -> UInt8[np.ndarray, "h w 3"]:
    points, colors = _samples(sources, min(_MAX_SAMPLES, (side * cell) ** 2))
    tree = cKDTree(points)
    v, u = np.meshgrid(np.arange(cell), np.arange(cell), indexing="ij")
    # Shares of the second and third corner; pixels outside the triangle show its nearest edge.
    b, c = (np.clip((px - 1) / max(cell - 3, 1), 0.0, 1.0) for px in (u, v))
    over = np.maximum(b + c - 1.0, 0.0) / 2
    shares = np.stack([1 - (b - over) - (c - over), b - over, c - over], axis=-1).reshape(-1, 3)
    texture = np.zeros((side * cell, side * cell, 3), np.uint8)
    for some in np.array_split(np.arange(len(corners)), max(1, len(corners) * len(shares) // 400_000)):
        _, nearest = tree.query((shares @ corners[some]).reshape(-1, 3))
        rows, columns = where[some, 1, None, None] * cell + v, where[some, 0, None, None] * cell + u
        texture[rows, columns] = colors[nearest].reshape(len(some), cell, cell, 3)
    return texture


def _samples(
    sources: Sequence[Surface], count: int
) -> tuple[Float[np.ndarray, "n 3"], UInt8[np.ndarray, "n 3"]]:
    """Return points spread over the surfaces by area, and in the middle of every triangle, with their colours."""
    meshes = [trimesh.Trimesh(s.vertices, s.faces, process=False) for s in sources]
    total = sum(mesh.area for mesh in meshes)
    points, colors = [], []
    for source, mesh in zip(sources, meshes):
        some = int(np.ceil(count * mesh.area / total))
        at, face, shares = trimesh.sample.sample_surface(mesh, some, return_barycentric=True, seed=0)
        points += [at, mesh.triangles_center]
        corners = source.faces[np.concatenate([face, np.arange(len(source.faces))])]
        middles = np.full((len(source.faces), 3), 1 / 3)
        colors.append(_colors(source, corners, np.concatenate([shares, middles])))
    return np.concatenate(points), np.concatenate(colors)


def _colors(source: Surface, corners: np.ndarray, shares: np.ndarray) -> UInt8[np.ndarray, "n 3"]:
    tint = np.array(source.rgba[:3])
    if source.colors is not None:
        tint = np.einsum("nk,nkd->nd", shares, source.colors[corners] / 255.0)
    if source.texture is None or source.uv is None:
        return np.round(255 * np.broadcast_to(tint, (len(corners), 3))).astype(np.uint8)
    uv = np.einsum("nk,nkd->nd", shares, source.uv[corners])
    uv = np.where((uv < 0.0) | (uv > 1.0), uv % 1.0, uv)  # textures repeat, but 1 is the far edge
    h, w = source.texture.shape[:2]
    column = np.minimum((uv[:, 0] * w).astype(np.int64), w - 1)
    row = np.minimum((uv[:, 1] * h).astype(np.int64), h - 1)
    return np.round(source.texture[row, column] * tint).astype(np.uint8)


def _interleaved(*axes: np.ndarray) -> np.ndarray:
    """Return Morton codes: the bits of 10-bit numbers in turn. They keep neighbours close."""
    bits = [((a >> bit) & 1) << (bit * len(axes) + k) for bit in range(10) for k, a in enumerate(axes)]
    return np.sum(bits, axis=0)


def _along_curve(points: np.ndarray) -> np.ndarray:
    """Number points along a curve through space."""
    low = points.min(axis=0)
    cells = (1023 * (points - low) / max(float(np.ptp(points, axis=0).max()), 1e-12)).astype(np.int64)
    return _interleaved(*cells.T)
