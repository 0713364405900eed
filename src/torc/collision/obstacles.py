"""The world as arrays, and one sphere against it, compiled.

The distance field at a sphere's centre gives a lower bound on the distance to the nearest occupied voxel's
cube; only where that bound is below the radius are the voxels in reach compared, cube by cube, and even there
the distance field tells how many voxels of a column can be skipped.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

STATIC, SELF = 1, 2
"""Flags beside the bits of touched objects."""
_UNKNOWN = 2
_HALF_DIAGONAL = 0.8660254037844387


class WorldArrays(NamedTuple):
    """The world, and the paddings for arm, gripper and attached spheres: columns voxels, boxes."""

    origin: np.ndarray
    voxel_size_m: float
    kind: np.ndarray
    bits: np.ndarray
    distance_m: np.ndarray
    boxes: np.ndarray
    padding: np.ndarray
    self_padding: float


@njit(cache=True)
def voxel_bound(x, y, z, world):
    """Lower bound on the distance from a point to the nearest occupied voxel's cube."""
    h = world.voxel_size_m
    outside, inside = 0.0, 0.0
    index0, index1, index2 = 0, 0, 0
    for axis in range(3):
        c = x if axis == 0 else (y if axis == 1 else z)
        n = world.kind.shape[axis]
        g = (c - world.origin[axis]) / h
        clamped = min(max(g, 0.0), float(n))
        outside += (g - clamped) ** 2
        i = min(int(clamped), n - 1)
        inside += (clamped - i - 0.5) ** 2
        if axis == 0:
            index0 = i
        elif axis == 1:
            index1 = i
        else:
            index2 = i
    near = world.distance_m[index0, index1, index2] - h * (np.sqrt(inside) + _HALF_DIAGONAL)
    if near < 0.0:
        near = 0.0
    return np.sqrt(outside * h * h + near * near)


@njit(cache=True)
def voxels_touched(x, y, z, radius, world, own, own_surface_counts, first_only):
    """(bits, flags) of the occupied voxels whose cubes a sphere touches. own: bits to ignore."""
    h = world.voxel_size_m
    nx, ny, nz = world.kind.shape
    gx, gy, gz = (x - world.origin[0]) / h, (y - world.origin[1]) / h, (z - world.origin[2]) / h
    r = radius / h
    r2 = r * r
    bits, flags = np.uint64(0), 0
    for i in range(max(0, int(np.floor(gx - r))), min(nx, int(np.floor(gx + r)) + 1)):
        dx = max(i - gx, gx - i - 1.0, 0.0)
        for j in range(max(0, int(np.floor(gy - r))), min(ny, int(np.floor(gy + r)) + 1)):
            dy = max(j - gy, gy - j - 1.0, 0.0)
            rest = r2 - dx * dx - dy * dy
            if rest <= 0.0:
                continue
            half = np.sqrt(rest)
            k, end = max(0, int(np.floor(gz - half))), min(nz, int(np.floor(gz + half)) + 1)
            while k < end:
                kind = world.kind[i, j, k]
                if kind == 0:
                    k += max(1, int(world.distance_m[i, j, k] / h - 0.001))
                    continue
                dz = max(k - gz, gz - k - 1.0, 0.0)
                if dz * dz < rest:
                    owner = world.bits[i, j, k]
                    ours = (owner & own) != 0
                    if not (ours and (kind == _UNKNOWN or not own_surface_counts)):
                        if owner == 0:
                            flags = STATIC
                        bits |= owner
                        if first_only:
                            return bits, flags
                k += 1
    return bits, flags


@njit(cache=True)
def box_distance(x, y, z, boxes):
    """Distance from a point to the nearest box; 0 within one, 1e9 if there is none."""
    nearest = 1e18
    for b in range(boxes.shape[0]):
        dx = max(boxes[b, 0] - x, x - boxes[b, 3], 0.0)
        dy = max(boxes[b, 1] - y, y - boxes[b, 4], 0.0)
        dz = max(boxes[b, 2] - z, z - boxes[b, 5], 0.0)
        nearest = min(nearest, dx * dx + dy * dy + dz * dz)
    return np.sqrt(nearest)


@njit(cache=True)
def clear_touched(spheres, radii, margin_m, world, kind, only):
    """Set kind to free where a grown sphere touches a voxel; only: bits of the owners affected, 0 for all."""
    h = world.voxel_size_m
    for s in range(spheres.shape[0]):
        r = (radii[s] + margin_m) / h
        lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
        g = np.empty(3)
        for axis in range(3):
            g[axis] = (spheres[s, axis] - world.origin[axis]) / h
            lo[axis] = max(0, int(np.floor(g[axis] - r)))
            hi[axis] = min(kind.shape[axis], int(np.floor(g[axis] + r)) + 1)
        for i in range(lo[0], hi[0]):
            dx = max(i - g[0], g[0] - i - 1.0, 0.0)
            for j in range(lo[1], hi[1]):
                dy = max(j - g[1], g[1] - j - 1.0, 0.0)
                for k in range(lo[2], hi[2]):
                    dz = max(k - g[2], g[2] - k - 1.0, 0.0)
                    if dx * dx + dy * dy + dz * dz < r * r and (world.bits[i, j, k] & only != 0 or only == 0):
                        kind[i, j, k] = 0
