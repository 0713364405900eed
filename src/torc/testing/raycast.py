"""Ray casting against boxes, cylinders and spheres, compiled."""

import numpy as np
from jaxtyping import Float, Float32, Int
from numba import njit

BOX, CYLINDER, SPHERE = 0, 1, 2
_FAR = 1e9


@njit(cache=True)
def _slab(o: float, d: float, h: float) -> tuple[float, float]:
    """Entry and exit distances of a ray through |x| <= h along one axis."""
    if abs(d) < 1e-12:
        return (-_FAR, _FAR) if abs(o) <= h else (_FAR, -_FAR)
    a, b = (-h - o) / d, (h - o) / d
    return (a, b) if a < b else (b, a)


@njit(cache=True)
def _round(b: float, a: float, c: float) -> tuple[float, float]:
    """Roots of a t^2 + 2 b t + c."""
    disc = b * b - a * c
    if a < 1e-12 or disc < 0:
        return (-_FAR, _FAR) if (a < 1e-12 and c <= 0) else (_FAR, -_FAR)
    root = np.sqrt(disc)
    return ((-b - root) / a, (-b + root) / a)


@njit(cache=True)
def _enter(kind: int, o: np.ndarray, d: np.ndarray, half: np.ndarray, normal: np.ndarray) -> float:
    """Distance (in units of d) to the first hit, in the shape's frame; fills the normal. Negative: no hit."""
    near, far, axis = -_FAR, _FAR, -1
    first = 0 if kind == 0 else 2
    last = 3 if kind != 2 else 2
    for k in range(first, last):
        a, b = _slab(o[k], d[k], half[k])
        if a > near:
            near, axis = a, k
        far = min(far, b)
    if kind != 0:
        n = 2 if kind == 1 else 3
        aa, bb, cc = 0.0, 0.0, -half[0] * half[0]
        for k in range(n):
            aa += d[k] * d[k]
            bb += o[k] * d[k]
            cc += o[k] * o[k]
        a, b = _round(bb, aa, cc)
        if a > near:
            near, axis = a, 3
        far = min(far, b)
    if near >= far or near <= 1e-6:
        return -1.0
    for k in range(3):
        normal[k] = 0.0
    if axis < 3:
        normal[axis] = -1.0 if d[axis] > 0 else 1.0
    else:
        for k in range(2 if kind == 1 else 3):
            normal[k] = (o[k] + near * d[k]) / half[0]
    return near


@njit(cache=True)
def cast_rays(
    width: int,
    height: int,
    K: Float[np.ndarray, "3 3"],
    T_world_camera: Float[np.ndarray, "4 4"],
    kinds: Int[np.ndarray, "s"],
    Ts_world_shape: Float[np.ndarray, "s 4 4"],
    half: Float[np.ndarray, "s 3"],
) -> tuple[Float32[np.ndarray, "h w"], Int[np.ndarray, "h w"], Float32[np.ndarray, "h w 3"]]:
    """Depth along the optical axis, index of the shape hit (-1: none) and world normals, per pixel."""
    depth = np.zeros((height, width), np.float32)
    hit = np.full((height, width), -1)
    normals = np.zeros((height, width, 3), np.float32)
    R_c, eye = T_world_camera[:3, :3], T_world_camera[:3, 3]
    best = np.full((height, width), _FAR)
    ray, d, o, normal = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for s in range(kinds.size):
        R = Ts_world_shape[s, :3, :3]
        for k in range(3):
            o[k] = 0.0
            for j in range(3):
                o[k] += R[j, k] * (eye[j] - Ts_world_shape[s, j, 3])
        M = np.ascontiguousarray(R.T) @ np.ascontiguousarray(R_c)
        for row in range(height):
            for col in range(width):
                ray[0] = (col - K[0, 2]) / K[0, 0]
                ray[1] = (row - K[1, 2]) / K[1, 1]
                ray[2] = 1.0
                for k in range(3):
                    d[k] = M[k, 0] * ray[0] + M[k, 1] * ray[1] + M[k, 2]
                t = _enter(kinds[s], o, d, half[s], normal)
                if 0.0 < t < best[row, col]:
                    best[row, col] = t
                    depth[row, col] = t
                    hit[row, col] = s
                    for k in range(3):
                        value = 0.0
                        for j in range(3):
                            value += R[k, j] * normal[j]
                        normals[row, col, k] = value
    return depth, hit, normals
