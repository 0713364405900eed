"""Footprints of objects on the table, as support functions over evenly spaced horizontal directions."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import rotation_about, wxyz_from_rotation
from torc.objects.models import ObjectModel, Quat

DIRECTIONS = 32
"""Even, so that the opposite of every direction is among them."""
LIE_ON_BACK = rotation_about((0, 1, 0), np.pi / 2)
"""Lays a box on its back: the front up, the top away from the robot."""
UP_TOLERANCE = 0.999

Extents = Float[np.ndarray, "32"]


def directions() -> Float[np.ndarray, "32 2"]:
    """Return unit directions in the plane of the table; direction k + 16 is the opposite of direction k."""
    t = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return np.stack([np.cos(t), np.sin(t)], axis=1)


@dataclass(frozen=True, eq=False)
class Footprint:
    """The shadow of an object on the table, about the model's origin: how far it reaches per direction, metres, and its
    flat top and base, if it has them; and how far the object reaches below and above the origin.
    """

    extents: Extents
    top: Extents | None
    base: Extents | None
    lowest_m: float
    highest_m: float
    rotation: Float[np.ndarray, "3 3"]

    @property
    def wxyz(self) -> Quat:
        """Its orientation as a quaternion."""
        w, x, y, z = (float(v) for v in wxyz_from_rotation(self.rotation))
        return w, x, y, z


def footprint(model: ObjectModel, rotation: Float[np.ndarray, "3 3"]) -> Footprint:
    """Return the footprint of a model in an orientation."""
    up = np.array([[0.0, 0.0, 1.0]])
    highest, lowest = float(model.support(up @ rotation)[0]), float(model.support(-up @ rotation)[0])
    top, base = _flat_end(model, rotation, 1.0, highest), _flat_end(model, rotation, -1.0, lowest)
    return Footprint(model.support(_horizontal() @ rotation), top, base, lowest, highest, rotation)


def _horizontal() -> Float[np.ndarray, "32 3"]:
    return np.pad(directions(), ((0, 0), (0, 1)))


def _flat_end(model: ObjectModel, rotation: np.ndarray, sign: float, reach_m: float) -> Extents | None:
    """Return the extents of the largest flat end (box or upright cylinder) that makes up the top or the base."""
    found = []
    for piece in model.pieces:
        R = rotation @ piece.T_object_piece[:3, :3]
        upright = {"cylinder": abs(R[2, 2]), "box": np.abs(R[2]).max()}.get(piece.kind, 0.0)
        height_m = float(piece.support(np.array([[0.0, 0.0, sign]]) @ rotation)[0])
        if upright > UP_TOLERANCE and abs(height_m - reach_m) < 1e-3:
            found.append(piece.support(_horizontal() @ rotation))
    # An end that is not under the middle carries nothing.
    return max((e for e in found if e.min() > 0.01), key=np.min, default=None)


def gaps(
    extents: Float[np.ndarray, "32"],
    positions: Float[np.ndarray, "n 2"],
    others: Float[np.ndarray, "m 32"],
    other_positions: Float[np.ndarray, "m 2"],
) -> Float[np.ndarray, "n m"]:
    """Return a lower bound of the distance between footprints (by separating axes); negative: overlap."""
    away = (other_positions[None] - positions[:, None]) @ directions().T
    opposite = np.roll(others, -DIRECTIONS // 2, axis=1)
    return (away - extents - opposite[None]).max(axis=2)


def fits_on(upper: Footprint, lower: Footprint, offset: Float[np.ndarray, "2"], overhang_m: float) -> bool:
    """True if the upper object's flat base rests on the lower one's flat top, `offset` from its origin."""
    if upper.base is None or lower.top is None:
        return False
    return bool((upper.base + directions() @ offset <= lower.top + overhang_m).all())
