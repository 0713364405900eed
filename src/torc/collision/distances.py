"""Distances of voxels to the nearest occupied one: exact, along one axis after the other, compiled."""

import numpy as np
from jaxtyping import Bool, Float32
from numba import njit

from torc.geometry.transforms import kernel_array
from torc.parallel import by_rows

_FAR_M = 1000.0
_NONE = 1 << 30
"""Stands for "nothing is occupied", above all squared distances in voxels."""


def distance_field(
    occupied: Bool[np.ndarray, "nx ny nz"], voxel_size_m: float
) -> Float32[np.ndarray, "nx ny nz"]:
    """Return the distance from each voxel's centre to the nearest occupied voxel's, metres; 1000 if all are free."""
    if not occupied.any():
        return np.full(occupied.shape, _FAR_M, dtype=np.float32)
    nx, ny, nz = occupied.shape
    squares, out = np.empty((ny, nx, nz), np.int32), np.empty((ny, nx, nz), np.float32)
    by_rows(_along_z_and_y, (kernel_array(occupied, np.bool_), np.arange(nx)), squares)
    by_rows(_along_x, (squares, out), float(voxel_size_m))
    return np.ascontiguousarray(out.transpose(1, 0, 2))


@njit(cache=True)
def _lower(squares, apex, least, start):
    """Replace, in every column, each row's square by the least of all rows' plus the squared distance to that row.

    Those are parabolas: `apex` and `least` hold those that are lowest somewhere, `start` from which row on
    (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012).
    """
    n, width = squares.shape
    for k in range(width):
        last = -1
        for row in range(n):
            if squares[row, k] == _NONE:
                continue
            raised, begins = squares[row, k] + row * row, 0
            while last >= 0:
                a = apex[last]
                lead = raised - least[last] - a * a
                begins = int(np.floor(lead / (2.0 * (row - a)))) + 1  # floats divide faster than integers
                if begins > start[last]:
                    break
                last, begins = last - 1, 0
            if begins < n:
                last += 1
                apex[last], least[last], start[last] = row, squares[row, k], begins
        end = n
        for i in range(last, -1, -1):
            for row in range(start[i], end):
                squares[row, k] = least[i] + (row - apex[i]) ** 2
            end = start[i]


@njit(cache=True)
def _scratch(n):
    return np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)


@njit(cache=True, nogil=True)
def _along_z_and_y(occupied, index, squares):
    """Write squared distances, in voxels, within each of some layers; layer i of `occupied` is index[i] of all."""
    _, ny, nz = occupied.shape
    plane, (apex, least, start) = np.empty((ny, nz), np.int32), _scratch(ny)
    for i in range(len(index)):
        for j in range(ny):
            nearest = -_NONE
            for k in range(nz):
                if occupied[i, j, k]:
                    nearest = k
                plane[j, k] = k - nearest
            nearest = _NONE
            for k in range(nz - 1, -1, -1):
                if occupied[i, j, k]:
                    nearest = k
                gap = min(plane[j, k], nearest - k)
                plane[j, k] = _NONE if gap > nz else gap * gap
        _lower(plane, apex, least, start)
        squares[:, index[i]] = plane


@njit(cache=True, nogil=True)
def _along_x(squares, out, voxel_m):
    """Write distances in metres from the squares within layers, which are overwritten."""
    _, nx, nz = squares.shape
    apex, least, start = _scratch(nx)
    for j in range(len(squares)):
        _lower(squares[j], apex, least, start)
        for i in range(nx):
            for k in range(nz):
                out[j, i, k] = np.sqrt(np.float64(squares[j, i, k])) * voxel_m
