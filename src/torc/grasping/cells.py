"""Group points in cubic cells, so that kernels visit only those near a gripper."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int64
from numba import njit


class PointCells(NamedTuple):
    """Points sorted by cell, also for kernels.

    Attributes:
        points: world frame.
        tags: an integer per point, e.g. its object's id.
        order: index of each point in the arrays that were grouped.
        starts: first point of each cell, and the number of points at the end.
        centers, radii: a sphere around the points of each cell; coordinate by coordinate, for vector instructions.
    """

    points: Float[np.ndarray, "n 3"]
    tags: Int64[np.ndarray, "n"]
    order: Int64[np.ndarray, "n"]
    starts: Int64[np.ndarray, "c1"]
    centers: Float[np.ndarray, "3 c"]
    radii: Float[np.ndarray, "c"]


def group(points: Float[np.ndarray, "n 3"], tags: Int64[np.ndarray, "n"], cell_m: float) -> PointCells:
    """Group points in cells of edge `cell_m`; within a cell they keep their order."""
    points = np.array(points, dtype=np.float64, order="C")  # kernels take writable arrays
    order, starts = cell_runs(points, cell_m)
    centers, radii = _spheres(points, order, starts)
    return PointCells(points[order], np.asarray(tags, dtype=np.int64)[order], order, starts, centers, radii)


def thin_out(
    points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], voxel_m: float
) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m 3"]]:
    """Return one point per cube: mean position; mean normal, or one point's at an edge (normals disagree).

    Normals that are not finite become zero.
    """
    p, n = (np.array(a, dtype=np.float64, order="C") for a in (points, normals))
    np.nan_to_num(n, copy=False, posinf=0.0, neginf=0.0)
    order, starts = cell_runs(p, voxel_m)
    return _means(p, n, order, starts)


def cell_runs(points: Float[np.ndarray, "n 3"], cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the order of the points by cell, and where each cell starts in that order, including the end."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64)
    keys = cell_keys(points, cell_m)
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    return order, np.flatnonzero(np.concatenate([[True], ranked[1:] != ranked[:-1], [True]]))


@njit(cache=True, nogil=True)
def cell_keys(points, cell_m):
    """Return one integer per point, equal within a cell."""
    index = np.empty((len(points), 3), dtype=np.int64)
    lower, upper = np.full(3, 1 << 60), np.full(3, -(1 << 60))
    for i in range(len(points)):
        for a in range(3):
            index[i, a] = int(np.floor(points[i, a] / cell_m))
            lower[a], upper[a] = min(lower[a], index[i, a]), max(upper[a], index[i, a])
    ny, nz = upper[1] - lower[1] + 1, upper[2] - lower[2] + 1
    out = np.empty(len(points), dtype=np.int64)
    for i in range(len(points)):
        out[i] = ((index[i, 0] - lower[0]) * ny + index[i, 1] - lower[1]) * nz + index[i, 2] - lower[2]
    return out


@njit(cache=True, nogil=True)
def _spheres(points, order, starts):
    """Return the mean of each cell and the largest distance from it."""
    n = len(starts) - 1
    centers, radii, center = np.empty((3, n)), np.zeros(n), np.empty(3)
    for c in range(n):
        center[:] = 0.0
        for k in range(starts[c], starts[c + 1]):
            for a in range(3):
                center[a] += points[order[k], a]
        center /= starts[c + 1] - starts[c]
        for k in range(starts[c], starts[c + 1]):
            d2 = 0.0
            for a in range(3):
                d2 += (points[order[k], a] - center[a]) ** 2
            radii[c] = max(radii[c], np.sqrt(d2))
        centers[:, c] = center
    return centers, radii


@njit(cache=True, nogil=True)
def _means(points, normals, order, starts):
    n = len(starts) - 1
    mean, normal = np.zeros((n, 3)), np.zeros((n, 3))
    for c in range(n):
        count = starts[c + 1] - starts[c]
        for k in range(starts[c], starts[c + 1]):
            for a in range(3):
                mean[c, a] += points[order[k], a] / count
                normal[c, a] += normals[order[k], a]
        length = np.sqrt(np.sum(normal[c] ** 2))
        if length < 0.9 * count:
            normal[c] = normals[order[starts[c]]]
            length = np.sqrt(np.sum(normal[c] ** 2))
        if length > 1e-9:
            normal[c] /= length
    return mean, normal


@njit(cache=True)
def axes_of(R):
    """Return the columns of a rotation as scalars: kernels would load them from the array again for every point."""
    return (R[0, 0], R[1, 0], R[2, 0]), (R[0, 1], R[1, 1], R[2, 1]), (R[0, 2], R[1, 2], R[2, 2])


@njit(cache=True)
def frame_of(R, tip):
    """Return a frame's axes and origin as scalars."""
    ex, ey, ez = axes_of(R)
    return ex, ey, ez, (tip[0], tip[1], tip[2])


@njit(cache=True)
def along(axis, px, py, pz):
    """Return the coordinate of a point, relative to a frame's origin, along one of its axes."""
    return axis[0] * px + axis[1] * py + axis[2] * pz


@njit(cache=True)
def find_reached(frame, slim, wide, bottom, top, centers, radii, reached):
    """Write which spheres come near a slim box about a frame's z-axis, or a wide one that ends further down.

    Boxes: greatest |x| and |y|, for the wide one also greatest z; both from z = `bottom`, none beyond `top`.
    """
    ex, ey, ez, origin = frame
    cx, cy, cz = centers[0], centers[1], centers[2]
    for c in range(len(radii)):
        px, py, pz, r = cx[c] - origin[0], cy[c] - origin[1], cz[c] - origin[2], radii[c]
        x, y, z = abs(along(ex, px, py, pz)) - r, abs(along(ey, px, py, pz)) - r, along(ez, px, py, pz)
        # Without branches, so that it becomes vector instructions.
        near = ((x <= slim[0]) & (y <= slim[1])) | ((x <= wide[0]) & (y <= wide[1]) & (z - r <= wide[2]))
        reached[c] = near & (z + r >= bottom) & (z - r <= top)


@njit(cache=True)
def gather(R, tip, box, cells, local, index):
    """Write coordinates in the frame (R, tip), and indices, of the points in a box of that frame; return how many.

    `box`: greatest |x| and |y|, least and greatest z.
    """
    frame = frame_of(R, tip)
    ex, ey, ez, origin = frame
    x1, y1, z0, z1 = box
    reached = np.empty(len(cells.radii), np.bool_)
    find_reached(frame, (x1, y1), (x1, y1, z0), z0, z1, cells.centers, cells.radii, reached)
    n = 0
    for c in range(len(reached)):
        if not reached[c]:
            continue
        for i in range(cells.starts[c], cells.starts[c + 1]):
            px, py, pz = (
                cells.points[i, 0] - origin[0],
                cells.points[i, 1] - origin[1],
                cells.points[i, 2] - origin[2],
            )
            y = along(ey, px, py, pz)
            if abs(y) > y1:
                continue
            z = along(ez, px, py, pz)
            if z < z0 or z > z1:
                continue
            x = along(ex, px, py, pz)
            if abs(x) > x1:
                continue
            local[n, 0], local[n, 1], local[n, 2] = x, y, z
            index[n] = i
            n += 1
    return n
