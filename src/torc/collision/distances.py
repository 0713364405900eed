"""Distances of voxels to the nearest occupied one: exact, along one axis after the other, compiled."""

import numpy as np
from jaxtyping import Bool, Float32
from numba import njit

from torc.geometry.transforms import kernel_array
from torc.parallel import by_rows

_FAR_M = 1000.0
_NONE = 1 << 11
"""Distances along an axis are cut here, voxels: single precision holds the sum of three such squares exactly."""


def distance_field(
    occupied: Bool[np.ndarray, "nx ny nz"], voxel_size_m: float
) -> Float32[np.ndarray, "nx ny nz"]:
    """Return the distance from each voxel's centre to the nearest occupied voxel's, metres; 1000 if all are free."""
    if not occupied.any():
        return np.full(occupied.shape, _FAR_M, dtype=np.float32)
    nx, ny, nz = occupied.shape
    squares, out = np.empty((ny, nx, nz), np.float32), np.empty((ny, nx, nz), np.float32)
    by_rows(_along_z_and_y, (kernel_array(occupied, np.bool_), np.arange(nx)), squares)
    by_rows(_along_x, (squares, out), float(voxel_size_m))
    return np.ascontiguousarray(out.transpose(1, 0, 2))


@njit(cache=True)
def _lower(squares, best):
    """Write, per row and column, the least of all rows' squares plus the square of the distance between the rows.

    Row by row outwards until nothing can be nearer: whole rows at a time, which become vector instructions.
    """
    n, width = squares.shape
    for u in range(n):
        for k in range(width):
            best[u, k] = squares[u, k]
        for r in range(1, n):
            gap, farther = np.float32(r * r), 0
            for k in range(width):
                farther += best[u, k] > gap
            if farther == 0:
                break
            for v in range(u - r, u + r + 1, 2 * r):
                if 0 <= v < n:
                    for k in range(width):
                        d = squares[v, k] + gap
                        best[u, k] = d if d < best[u, k] else best[u, k]


@njit(cache=True, nogil=True)
def _along_z_and_y(occupied, index, squares):
    """Write squared distances, in voxels, within each of some layers; layer i of `occupied` is index[i] of all."""
    _, ny, nz = occupied.shape
    along_z, plane = np.empty((ny, nz), np.float32), np.empty((ny, nz), np.float32)
    for i in range(len(index)):
        for j in range(ny):
            gap = _NONE
            for k in range(nz):
                gap = 0 if occupied[i, j, k] else min(gap + 1, _NONE)
                along_z[j, k] = gap
            gap = _NONE
            for k in range(nz - 1, -1, -1):
                gap = min(gap + 1, int(along_z[j, k]))
                along_z[j, k] = gap * gap
        _lower(along_z, plane)
        squares[:, index[i]] = plane


@njit(cache=True, nogil=True)
def _along_x(squares, out, voxel_m):
    """Write distances in metres from the squares within layers."""
    _, nx, nz = squares.shape
    plane = np.empty((nx, nz), np.float32)
    for j in range(len(squares)):
        _lower(squares[j], plane)
        for i in range(nx):
            for k in range(nz):
                out[j, i, k] = np.sqrt(np.float64(plane[i, k])) * voxel_m
