"""Compiled tests of points against upright boxes and voxels.

A box is a row of eight numbers: its centre (x, y, z), half its edges (along its heading, across it, upwards), cosine
and sine of its heading about the vertical. A grid's frame is its origin (x, y, z) and the edge of its voxels. Twenty-
seven points stand for a box: those at -SPREAD, 0 and SPREAD of its half edges.
"""

import numpy as np
from jaxtyping import Bool, Float, UInt64
from numba import njit

SPREAD = 0.8
POINTS = 27

Boxes = Float[np.ndarray, "n 8"]
_ZERO = np.uint64(0)


@njit(cache=True, inline="always")
def _voxel(p: float, low: float, voxel_m: float) -> int:
    return int(np.floor((p - low) / voxel_m))


@njit(cache=True)
def _point(box: Float[np.ndarray, "8"], number: int) -> tuple[float, float, float]:
    """Return one of the points that stand for a box, world frame."""
    u = SPREAD * box[3] * (number // 9 - 1)
    v = SPREAD * box[4] * (number // 3 % 3 - 1)
    w = SPREAD * box[5] * (number % 3 - 1)
    return box[0] + box[6] * u - box[7] * v, box[1] + box[7] * u + box[6] * v, box[2] + w


@njit(cache=True)
def _holds(box: Float[np.ndarray, "8"], x: float, y: float, z: float, scale: float) -> bool:
    """Check whether a point lies within a box that is scaled about its centre."""
    dx, dy, dz = x - box[0], y - box[1], z - box[2]
    return (
        abs(dz) <= scale * box[5]
        and abs(box[6] * dx + box[7] * dy) <= scale * box[3]
        and abs(box[6] * dy - box[7] * dx) <= scale * box[4]
    )


@njit(cache=True)
def _enters(
    box: Float[np.ndarray, "8"], eye: Float[np.ndarray, "3"], x: float, y: float, z: float, scale: float
) -> bool:
    """Check whether the segment from the eye to a point meets a box that is scaled about its centre (slab test)."""
    ex, ey, ez = eye[0] - box[0], eye[1] - box[1], eye[2] - box[2]
    dx, dy, dz = x - eye[0], y - eye[1], z - eye[2]
    first, last = 0.0, 1.0
    for axis in range(3):
        if axis == 0:
            start, way = box[6] * ex + box[7] * ey, box[6] * dx + box[7] * dy
        elif axis == 1:
            start, way = box[6] * ey - box[7] * ex, box[6] * dy - box[7] * dx
        else:
            start, way = ez, dz
        half = scale * box[3 + axis]
        if abs(way) < 1e-12:
            if abs(start) > half:
                return False
            continue
        a, b = (-half - start) / way, (half - start) / way
        first, last = max(first, min(a, b)), min(last, max(a, b))
        if first > last:
            return False
    return True


@njit(cache=True)
def extended_down(boxes: Boxes, seen: Bool[np.ndarray, "nx ny nz"], frame: Float[np.ndarray, "4"]) -> Boxes:
    """Extend each box downwards through unseen voxels below its centre until it meets another original box."""
    nx, ny, _ = seen.shape
    out = boxes.copy()
    for n in range(boxes.shape[0]):
        x, y, bottom = boxes[n, 0], boxes[n, 1], boxes[n, 2] - boxes[n, 5]
        i, j, k = (
            _voxel(x, frame[0], frame[3]),
            _voxel(y, frame[1], frame[3]),
            _voxel(bottom, frame[2], frame[3]) - 1,
        )
        if i < 0 or j < 0 or i >= nx or j >= ny:
            continue
        low = bottom
        while 0 <= k < seen.shape[2] and not seen[i, j, k]:
            z, meets = frame[2] + frame[3] * k, False
            for m in range(boxes.shape[0]):
                meets = meets or (m != n and _holds(boxes[m], x, y, z + 0.5 * frame[3], 1.0))
            if meets:
                break
            low = z
            k -= 1
        top = boxes[n, 2] + boxes[n, 5]
        out[n, 2], out[n, 5] = 0.5 * (top + low), 0.5 * (top - low)
    return out


@njit(cache=True)
def fit_shares(
    poses: Boxes,
    bodies: Boxes,
    scale: float,
    seen: Bool[np.ndarray, "nx ny nz"],
    frame: Float[np.ndarray, "4"],
) -> Float[np.ndarray, "n 2"]:
    """Return, per pose, the share of its points in unseen voxels, and the share inside the scaled bodies."""
    nx, ny, nz = seen.shape
    out = np.zeros((poses.shape[0], 2))
    for n in range(poses.shape[0]):
        for number in range(POINTS):
            x, y, z = _point(poses[n], number)
            i, j, k = (
                _voxel(x, frame[0], frame[3]),
                _voxel(y, frame[1], frame[3]),
                _voxel(z, frame[2], frame[3]),
            )
            if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz and not seen[i, j, k]:
                out[n, 0] += 1.0 / POINTS
            for m in range(bodies.shape[0]):
                if _holds(bodies[m], x, y, z, scale):
                    out[n, 1] += 1.0 / POINTS
                    break
    return out


@njit(cache=True)
def settle(
    poses: Boxes, bodies: Boxes, bits: UInt64[np.ndarray, "m"], slack: float
) -> UInt64[np.ndarray, "n"]:
    """Let each pose fall in place onto the highest body below its centre; return that body's bit, 0 if there is none.

    A body counts as below if its top is at most `slack` above the pose's lower side.
    """
    on = np.zeros(poses.shape[0], np.uint64)
    for n in range(poses.shape[0]):
        bottom, best = poses[n, 2] - poses[n, 5], -np.inf
        for m in range(bodies.shape[0]):
            top = bodies[m, 2] + bodies[m, 5]
            if best < top <= bottom + slack and _holds(
                bodies[m], poses[n, 0], poses[n, 1], bodies[m, 2], 1.0
            ):
                best, on[n] = top, bits[m]
        if best > -np.inf:
            poses[n, 2] = best + poses[n, 5]
    return on


@njit(cache=True)
def hider_masks(
    poses: Boxes,
    bodies: Boxes,
    bits: UInt64[np.ndarray, "m"],
    eye_scale: Float[np.ndarray, "4"],
    seen: Bool[np.ndarray, "nx ny nz"],
    hidden_by: UInt64[np.ndarray, "nx ny nz"],
    frame: Float[np.ndarray, "4"],
) -> tuple[UInt64[np.ndarray, "n 27"], Bool[np.ndarray, "n 27"]]:
    """Return, per point of each pose, the bits of all that hides it, and whether it was never seen.

    Points that were seen have no bits.

    A point is hidden by what hides its voxel in the picture, and by each scaled body between the eye and it.
    `eye_scale` is the camera's position and that scale; scale 0 leaves the bodies out.
    """
    nx, ny, nz = seen.shape
    masks = np.zeros((poses.shape[0], POINTS), np.uint64)
    hidden = np.zeros((poses.shape[0], POINTS), np.bool_)
    eye, scale = eye_scale[:3], eye_scale[3]
    for n in range(poses.shape[0]):
        for number in range(POINTS):
            x, y, z = _point(poses[n], number)
            i, j, k = (
                _voxel(x, frame[0], frame[3]),
                _voxel(y, frame[1], frame[3]),
                _voxel(z, frame[2], frame[3]),
            )
            if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz or seen[i, j, k]:
                continue
            hidden[n, number] = True
            mask = hidden_by[i, j, k]
            if scale > 0.0:
                for m in range(bodies.shape[0]):
                    if mask & bits[m] == _ZERO and _enters(bodies[m], eye, x, y, z, scale):
                        mask |= bits[m]
            masks[n, number] = mask
    return masks, hidden
