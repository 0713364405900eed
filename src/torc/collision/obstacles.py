"""Check one sphere against the world as arrays, compiled.

The distance field at a sphere's centre gives a lower bound on the distance to the nearest occupied voxel's cube; only
where that bound is below the radius are the voxels in reach compared, cube by cube, and even there the distance field
says how many voxels of a column can be skipped.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

STATIC, SELF = 1, 2
"""Flags beside the bits of touched objects."""
BLOCK = 4
"""Edge of the blocks whose owners are combined, in voxels."""
_SURFACE, _UNKNOWN = 1, 2
_HALF_DIAGONAL = 0.8660254037844387


class WorldArrays(NamedTuple):
    """The world.

    block_bits: of each block of BLOCK^3 voxels the bits of all its surface voxels, and of all its unknown ones.
    block_static: the block has occupied voxels of no object.
    padding: for arm, gripper and attached spheres; columns: against voxels, against boxes.
    """

    origin: np.ndarray
    voxel_size_m: float
    kind: np.ndarray
    bits: np.ndarray
    distance_m: np.ndarray
    block_bits: np.ndarray
    block_static: np.ndarray
    boxes: np.ndarray
    padding: np.ndarray
    self_padding: float


@njit(cache=True)
def voxel_bound(x, y, z, world):
    """Return a lower bound on the distance from a point to the nearest occupied voxel's cube."""
    h, (nx, ny, nz) = world.voxel_size_m, world.kind.shape
    i, out_x, in_x = _along_axis((x - world.origin[0]) / h, nx)
    j, out_y, in_y = _along_axis((y - world.origin[1]) / h, ny)
    k, out_z, in_z = _along_axis((z - world.origin[2]) / h, nz)
    near = max(world.distance_m[i, j, k] - h * (np.sqrt(in_x + in_y + in_z) + _HALF_DIAGONAL), 0.0)
    return np.sqrt((out_x + out_y + out_z) * h * h + near * near)


@njit(cache=True)
def _along_axis(g, n):
    """Return the nearest voxel to a coordinate, in voxels; squared distances to the grid and on to its centre."""
    clamped = min(max(g, 0.0), float(n))
    i = min(int(clamped), n - 1)
    return i, (g - clamped) ** 2, (clamped - i - 0.5) ** 2


@njit(cache=True)
def sum_up_blocks(kind, bits):
    """Return (block_bits, block_static) of a grid, see WorldArrays."""
    nx, ny, nz = kind.shape
    shape = ((nx + BLOCK - 1) // BLOCK, (ny + BLOCK - 1) // BLOCK, (nz + BLOCK - 1) // BLOCK)
    block_bits = np.zeros((shape[0], shape[1], shape[2], 2), np.uint64)
    block_static = np.zeros(shape, np.bool_)
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if kind[i, j, k] == 0:
                    continue
                a, b, c = i // BLOCK, j // BLOCK, k // BLOCK
                block_bits[a, b, c, kind[i, j, k] - _SURFACE] |= bits[i, j, k]
                if bits[i, j, k] == 0:
                    block_static[a, b, c] = True
    return block_bits, block_static


@njit(cache=True)
def _voxels_of_block(a, b, c, g, r2, world, own, own_surface_counts, bits, flags, first_only):
    """Add the bits and flags of the voxels of one block whose cubes the sphere touches; g, r2 in voxels."""
    nx, ny, nz = world.kind.shape
    for i in range(a * BLOCK, min(nx, (a + 1) * BLOCK)):
        dx = max(i - g[0], g[0] - i - 1.0, 0.0)
        for j in range(b * BLOCK, min(ny, (b + 1) * BLOCK)):
            dy = max(j - g[1], g[1] - j - 1.0, 0.0)
            rest = r2 - dx * dx - dy * dy
            if rest <= 0.0:
                continue
            for k in range(c * BLOCK, min(nz, (c + 1) * BLOCK)):
                kind = world.kind[i, j, k]
                if kind == 0:
                    continue
                dz = max(k - g[2], g[2] - k - 1.0, 0.0)
                if dz * dz >= rest:
                    continue
                owner = world.bits[i, j, k]
                if (owner & own) != 0 and (kind == _UNKNOWN or not own_surface_counts):
                    continue
                if owner == 0:
                    flags |= STATIC
                bits |= owner
                if first_only:
                    return bits, flags
    return bits, flags


@njit(cache=True)
def _blocks_between(low, high, count):
    """Return the first and one past the last block of a row of count blocks that meet an interval in voxels."""
    return max(0, int(np.floor(low / BLOCK))), min(count, int(np.floor(high / BLOCK)) + 1)


@njit(cache=True)
def _outside(x, block):
    """Return how far x lies outside a block along one axis, in voxels."""
    return max(block * BLOCK - x, x - (block + 1) * BLOCK, 0.0)


@njit(cache=True)
def voxels_touched(x, y, z, radius, world, own, own_surface_counts, bits, flags, first_only):
    """Add the bits and flags of the occupied voxels whose cubes a sphere touches; return (bits, flags).

    own: bits to ignore. Blocks that cannot add anything new are left out.
    """
    h = world.voxel_size_m
    g = ((x - world.origin[0]) / h, (y - world.origin[1]) / h, (z - world.origin[2]) / h)
    r = radius / h
    blocks = world.block_static.shape
    a0, a1 = _blocks_between(g[0] - r, g[0] + r, blocks[0])
    b0, b1 = _blocks_between(g[1] - r, g[1] + r, blocks[1])
    c0, c1 = _blocks_between(g[2] - r, g[2] + r, blocks[2])
    for a in range(a0, a1):
        for b in range(b0, b1):
            rest = r * r - _outside(g[0], a) ** 2 - _outside(g[1], b) ** 2
            for c in range(c0, c1):
                if _outside(g[2], c) ** 2 >= rest:
                    continue
                surface, unknown = world.block_bits[a, b, c, 0], world.block_bits[a, b, c, 1]
                news = (unknown & ~own) | (surface if own_surface_counts else surface & ~own)
                if (news & ~bits) == 0 and not (world.block_static[a, b, c] and flags & STATIC == 0):
                    continue
                bits, flags = _voxels_of_block(
                    a, b, c, g, r * r, world, own, own_surface_counts, bits, flags, first_only
                )
                if first_only and (bits != 0 or flags != 0):
                    return bits, flags
    return bits, flags


@njit(cache=True)
def box_distance(x, y, z, boxes):
    """Return the distance from a point to the nearest box; 0 within one, 1e9 if there is none."""
    nearest = 1e18
    for b in range(boxes.shape[0]):
        dx = max(boxes[b, 0] - x, x - boxes[b, 3], 0.0)
        dy = max(boxes[b, 1] - y, y - boxes[b, 4], 0.0)
        dz = max(boxes[b, 2] - z, z - boxes[b, 5], 0.0)
        nearest = min(nearest, dx * dx + dy * dy + dz * dz)
    return np.sqrt(nearest)


@njit(cache=True)
def clear_touched(spheres, radii, world, kind, only):
    """Set kind to free where a sphere touches a voxel; only: bits of the owners affected, 0 for all."""
    h = world.voxel_size_m
    for s in range(spheres.shape[0]):
        r = radii[s] / h
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
