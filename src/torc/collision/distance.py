"""Exact Euclidean distance field of a voxel grid.

Separable: two sweeps along z, then the lower envelope of parabolas along y and x (Felzenszwalb and
Huttenlocher, Distance Transforms of Sampled Functions, 2012). Integer arithmetic on squared distances, so the
result is exact.
"""

import numpy as np
from jaxtyping import Bool, Float32
from numba import njit

from torc.geometry.arrays import kernel_array

_FAR = 1 << 28


@njit(cache=True)
def _envelope(f, n, vertex, bound, out):
    """out[i] = min_j f[j] + (i - j)^2; f holds integers, _FAR where there is none."""
    k = -1
    for j in range(n):
        if f[j] >= _FAR:
            continue
        while k >= 0:
            v = vertex[k]
            # First integer position from which parabola j is at least as low as parabola v.
            numerator = (f[j] + j * j) - (f[v] + v * v)
            start = -((-numerator) // (2 * (j - v)))
            if start > bound[k]:
                break
            k -= 1
        k += 1
        vertex[k] = j
        if k == 0:
            bound[k] = -_FAR
        else:
            v = vertex[k - 1]
            bound[k] = -((-((f[j] + j * j) - (f[v] + v * v))) // (2 * (j - v)))
    if k < 0:
        for i in range(n):
            out[i] = _FAR
        return
    count, k = k + 1, 0
    for i in range(n):
        while k + 1 < count and bound[k + 1] <= i:
            k += 1
        d = i - vertex[k]
        out[i] = f[vertex[k]] + d * d


@njit(cache=True)
def _squared_distance(occupied):
    """Squared distance, in voxels, from each voxel's centre to the nearest occupied one's."""
    nx, ny, nz = occupied.shape
    g = np.empty((nx, ny, nz), np.int32)
    n = max(nx, ny)
    f, out = np.empty(n, np.int64), np.empty(n, np.int64)
    vertex, bound = np.empty(n, np.int64), np.empty(n, np.int64)
    for x in range(nx):
        for y in range(ny):
            last = -_FAR
            for z in range(nz):
                if occupied[x, y, z]:
                    last = z
                g[x, y, z] = min(z - last, 16000)
            last = _FAR
            for z in range(nz - 1, -1, -1):
                if occupied[x, y, z]:
                    last = z
                d = min(g[x, y, z], last - z)
                g[x, y, z] = d * d if d < 16000 else _FAR
        for z in range(nz):
            for y in range(ny):
                f[y] = g[x, y, z]
            _envelope(f, ny, vertex, bound, out)
            for y in range(ny):
                g[x, y, z] = out[y]
    for y in range(ny):
        for z in range(nz):
            for x in range(nx):
                f[x] = g[x, y, z]
            _envelope(f, nx, vertex, bound, out)
            for x in range(nx):
                g[x, y, z] = out[x]
    return g


@njit(cache=True)
def _metres(squared, voxel_size_m):
    out = np.empty(squared.shape, np.float32)
    a, b = squared.ravel(), out.ravel()
    for i in range(a.size):
        b[i] = np.sqrt(a[i]) * voxel_size_m
    return out


def distance_field(
    occupied: Bool[np.ndarray, "nx ny nz"], voxel_size_m: float
) -> Float32[np.ndarray, "nx ny nz"]:
    """Metres from each voxel's centre to the nearest occupied voxel's centre; > 100 if there is none."""
    return _metres(_squared_distance(kernel_array(occupied, np.bool_)), float(voxel_size_m))
