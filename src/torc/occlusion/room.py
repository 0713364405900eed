"""Find where an object could still be: poses in which nearly all of it lies in unseen space."""

from functools import lru_cache

import numpy as np
from jaxtyping import Bool

from torc.geometry.transforms import rotation_about
from torc.objects.models import ObjectModel

SHARE = 0.9
"""Share of an object's voxels that must be unseen: voxels on the rim of what is hidden count as seen."""
_YAWS = 4
_UPRIGHT = (np.eye(3), rotation_about((0, 1, 0), np.pi / 2), rotation_about((1, 0, 0), np.pi / 2))
"""Turns that point each axis of the model upwards."""
_PER_VOXEL = 2
"""Points along each axis of a voxel by which a shape is sampled."""


def places_left(unseen: Bool[np.ndarray, "nx ny nz"], model: ObjectModel, voxel_size_m: float) -> int:
    """Count the poses in which the object could be; 0 if it can be nowhere.

    They are at every voxel, on each of its axes and turned in steps of 45 degrees, with at least SHARE of it in unseen
    voxels. It may hang in the air there, so 0 proves that it is not there, as far as its outline is that of its model.
    """
    from scipy.signal import fftconvolve  # slow to import, rarely needed

    at = np.argwhere(unseen)
    if not len(at):
        return 0
    low, high = at.min(axis=0), at.max(axis=0) + 1
    room = unseen[tuple(slice(a, b) for a, b in zip(low, high))].astype(np.float32)
    count = 0
    for shape in _shapes(model, voxel_size_m):
        if room.sum() < SHARE * shape.sum():
            continue
        # An object whose box is larger than the room may still fit with the share that may be outside.
        padded = np.pad(room, [(max(0, s - r), max(0, s - r)) for s, r in zip(shape.shape, room.shape)])
        inside = fftconvolve(padded, shape[::-1, ::-1, ::-1], mode="valid")
        count += int(np.count_nonzero(inside >= SHARE * shape.sum() - 0.5))
    return count


@lru_cache(maxsize=64)
def _shapes(model: ObjectModel, voxel_size_m: float) -> tuple[np.ndarray, ...]:
    """Return the model in voxels, in each of its poses."""
    points = _points_within(model, voxel_size_m / _PER_VOXEL)
    shapes = []
    for upright in _UPRIGHT:
        for k in range(_YAWS):
            turned = points @ (rotation_about((0, 0, 1), np.pi * k / _YAWS) @ upright).T
            index = np.floor((turned - turned.min(axis=0)) / voxel_size_m + 1e-6).astype(np.int64)
            shape = np.zeros(index.max(axis=0) + 1, np.float32)
            np.add.at(shape, tuple(index.T), 1.0)
            # Voxels that it fills by at least half: those of its rim do not count.
            shapes.append((shape >= min(0.5 * _PER_VOXEL**3, shape.max())).astype(np.float32))
    return tuple(shapes)


def _points_within(model: ObjectModel, spacing_m: float) -> np.ndarray:
    """Return a lattice within the model's pieces, at least their middles."""
    lower = np.min([piece.bounds[0] for piece in model.pieces], axis=0)
    upper = np.max([piece.bounds[1] for piece in model.pieces], axis=0)
    axes = [np.arange(a + spacing_m / 2, b, spacing_m) for a, b in zip(lower, upper)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.zeros(len(lattice), dtype=bool)
    for piece in model.pieces:
        inside |= piece.contains(lattice)
    return np.concatenate([lattice[inside], [piece.bounds.mean(axis=0) for piece in model.pieces]])
