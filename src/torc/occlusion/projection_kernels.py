"""Compiled passes between voxels and pixels."""

import numpy as np
from numba import njit

HIDDEN, FREE, NO_READING, OUT_OF_VIEW = 0, 1, 2, 3
_EMPTY = -128


@njit(cache=True)
def vote_labels(points, object_id, origin, voxel_size_m, label, votes):
    """Let an object's points vote for their voxels' label, in place.

    Majority vote in one pass (Boyer and Moore 1981): an id with more than half of a voxel's points wins it.
    """
    nx, ny, nz = label.shape
    for n in range(points.shape[0]):
        i = int(np.floor((points[n, 0] - origin[0]) / voxel_size_m))
        j = int(np.floor((points[n, 1] - origin[1]) / voxel_size_m))
        k = int(np.floor((points[n, 2] - origin[2]) / voxel_size_m))
        if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
            continue
        if label[i, j, k] == object_id:
            votes[i, j, k] += 1
        elif votes[i, j, k] == 0:
            label[i, j, k] = object_id
            votes[i, j, k] = 1
        else:
            votes[i, j, k] -= 1


@njit(cache=True)
def _seen_free_around(seen, surface, i, j, k):
    """Check whether a voxel and all its neighbours in the grid were seen and held no surface."""
    nx, ny, nz = seen.shape
    for a in range(max(i - 1, 0), min(i + 2, nx)):
        for b in range(max(j - 1, 0), min(j + 2, ny)):
            for c in range(max(k - 1, 0), min(k + 2, nz)):
                if not seen[a, b, c] or surface[a, b, c] != _EMPTY:
                    return False
    return True


@njit(cache=True)
def points_in_free_space(points, origin, voxel_size_m, seen, surface):
    """Return which points lie where earlier snapshots saw free space, one voxel away from anything else."""
    nx, ny, nz = seen.shape
    out = np.zeros(points.shape[0], np.bool_)
    known = np.zeros((nx, ny, nz), np.int8)
    for n in range(points.shape[0]):
        i = int(np.floor((points[n, 0] - origin[0]) / voxel_size_m))
        j = int(np.floor((points[n, 1] - origin[1]) / voxel_size_m))
        k = int(np.floor((points[n, 2] - origin[2]) / voxel_size_m))
        if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
            continue
        if known[i, j, k] == 0:
            known[i, j, k] = 1 if _seen_free_around(seen, surface, i, j, k) else -1
        out[n] = known[i, j, k] == 1
    return out


@njit(cache=True, nogil=True)
def project_voxels(
    shape, origin, voxel_size_m, T_camera_world, K, depth, pixel_bits, disturbed, object_depth_m
):
    """Determine how one snapshot sees each voxel's centre, through the pixel nearest to its projection.

    Returns, per voxel: FREE (in front of the surface), HIDDEN (behind it), NO_READING or OUT_OF_VIEW; the bits of the
    pixel that hides it or has no reading; whether it lies behind a disturbed pixel by at most `object_depth_m`,
    measured along the ray.
    """
    nx, ny, nz = shape
    height, width = depth.shape
    state = np.full(shape, OUT_OF_VIEW, np.uint8)
    bits = np.zeros(shape, np.uint64)
    near_behind = np.zeros(shape, np.bool_)
    T = T_camera_world
    for i in range(nx):
        x = origin[0] + voxel_size_m * (i + 0.5)
        for j in range(ny):
            y = origin[1] + voxel_size_m * (j + 0.5)
            px = T[0, 0] * x + T[0, 1] * y + T[0, 3]
            py = T[1, 0] * x + T[1, 1] * y + T[1, 3]
            pz = T[2, 0] * x + T[2, 1] * y + T[2, 3]
            for k in range(nz):
                z = origin[2] + voxel_size_m * (k + 0.5)
                cz = pz + T[2, 2] * z
                if cz <= 0:
                    continue
                rx, ry = (px + T[0, 2] * z) / cz, (py + T[1, 2] * z) / cz
                col = int(np.floor(K[0, 0] * rx + K[0, 2] + 0.5))
                row = int(np.floor(K[1, 1] * ry + K[1, 2] + 0.5))
                if col < 0 or row < 0 or col >= width or row >= height:
                    continue
                d = depth[row, col]
                if d > cz:
                    state[i, j, k] = FREE
                    continue
                state[i, j, k] = NO_READING if d == 0 else HIDDEN
                bits[i, j, k] = pixel_bits[row, col]
                if disturbed[row, col] and d > 0:
                    along_ray_m = (cz - d) * np.sqrt(1.0 + rx * rx + ry * ry)
                    near_behind[i, j, k] = along_ray_m <= object_depth_m
    return state, bits, near_behind


@njit(cache=True)
def hold_bridged(
    pixels, depth, pixel_bits, disturbed, K, T_world_camera, origin, voxel_size_m, state, bits, near_behind
):
    """Make FREE voxels that bridged pixels of objects lie in HIDDEN by them, in place.

    With a reading there they would hold a surface, whichever side of it their centres are on.
    """
    nx, ny, nz = state.shape
    T = T_world_camera
    index = np.empty(3, np.int64)
    for n in range(pixels.shape[0]):
        row, col = pixels[n, 0], pixels[n, 1]
        z = float(depth[row, col])
        if z == 0:
            continue
        x, y = (col - K[0, 2]) / K[0, 0] * z, (row - K[1, 2]) / K[1, 1] * z
        for a in range(3):
            index[a] = int(
                np.floor((T[a, 0] * x + T[a, 1] * y + T[a, 2] * z + T[a, 3] - origin[a]) / voxel_size_m)
            )
        i, j, k = index
        if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
            continue
        if state[i, j, k] == FREE:
            state[i, j, k] = HIDDEN
            bits[i, j, k] = 0
            near_behind[i, j, k] = disturbed[row, col]
        if state[i, j, k] == HIDDEN and bits[i, j, k] == 0:
            bits[i, j, k] = pixel_bits[row, col]
