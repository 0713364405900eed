"""Collision geoms covered by spheres.

The spheres cover a geom up to `tolerance_m` (collision checks pad them by more than that), and stick out of it as
little as a small number of spheres allows.
"""

from collections.abc import Callable
from itertools import product

import numpy as np
from jaxtyping import Float

Spheres = Float[np.ndarray, "n 4"]
"""x, y, z, radius in the geom's frame."""


def cover_capsule(radius: float, half_length: float, tolerance_m: float) -> Spheres:
    """Spheres of the capsule's radius along its axis (z), so close that notches are at most tolerance_m deep."""
    depth = min(tolerance_m, 0.3 * radius)
    spacing = 2.0 * np.sqrt(2.0 * radius * depth - depth * depth)
    n = 1 + int(np.ceil(2.0 * half_length / spacing - 1e-9)) if half_length > 0 else 1
    out = np.zeros((n, 4))
    out[:, 2] = np.linspace(-half_length, half_length, n) if n > 1 else 0.0
    out[:, 3] = radius
    return out


def cover_cylinder(radius: float, half_length: float, tolerance_m: float) -> Spheres:
    """One sphere per slab about as high as the cylinder is wide; rims stick out by at most tolerance_m."""
    n = max(1, round(half_length / radius))
    half_slab = half_length / n
    out = np.zeros((n, 4))
    out[:, 2] = (2.0 * np.arange(n) + 1.0) * half_slab - half_length
    out[:, 3] = np.hypot(radius, half_slab) - min(tolerance_m, 0.3 * radius)
    return out


def cover_box(half_size: np.ndarray, tolerance_m: float) -> Spheres:
    """One sphere per cell of a grid of roughly cubic cells; the cells' corners stick out by at most tolerance_m."""
    half = np.asarray(half_size, dtype=float)
    counts = np.maximum(1, np.rint(half / half.min())).astype(int)
    cell = half / counts
    axes = [(2.0 * np.arange(n) + 1.0) * c - h for n, c, h in zip(counts, cell, half)]
    centers = np.array(list(product(*axes)))
    radius = np.linalg.norm(cell) - min(tolerance_m, 0.4 * half.min())
    return np.column_stack([centers, np.full(len(centers), radius)])


def cover_sphere(radius: float) -> Spheres:
    """The sphere itself."""
    return np.array([[0.0, 0.0, 0.0, radius]])


def cover_geom(kind: str, size: np.ndarray, aabb_half: np.ndarray, tolerance_m: float) -> Spheres:
    """Spheres of a MuJoCo geom, in its frame (for meshes and ellipsoids: of its bounding box).

    Args:
        kind: sphere, capsule, cylinder, box, ellipsoid or mesh.
        size: MuJoCo's size parameters (half sizes).
        aabb_half: half size of its bounding box.
        tolerance_m: see the module.
    """
    covers: dict[str, Callable[[], Spheres]] = {
        "sphere": lambda: cover_sphere(size[0]),
        "capsule": lambda: cover_capsule(size[0], size[1], tolerance_m),
        "cylinder": lambda: cover_cylinder(size[0], size[1], tolerance_m),
    }
    return covers.get(kind, lambda: cover_box(aabb_half, tolerance_m))()


def enclosing_center(track: Float[np.ndarray, "k 3"]) -> tuple[np.ndarray, float]:
    """Middle of a track's bounding box, and the largest distance of the track from it."""
    center = 0.5 * (track.min(axis=0) + track.max(axis=0))
    return center, float(np.linalg.norm(track - center, axis=1).max())
