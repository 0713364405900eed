"""What an object must be to be simulated, beyond the right numbers in the right places."""

from pathlib import Path

import numpy as np

from torc.errors import InputError
from torc.objects.models import CollisionPiece, ObjectModel, pieces_bounds
from torc.objects.schema import MAX_SIZE_M, MIN_SIZE_M

_FRAME_TOLERANCE_M = 1e-5
_MIN_VOLUME_M3, _MIN_THICKNESS_M = 1e-12, 1e-5
_LEAST_M2, _MOST_M2 = MIN_SIZE_M**2, 12.0
"""Of all surfaces together: a side of the smallest thing, and a cube of 1 m from both sides. Every 2.5 mm2 get a
sample where grasps are planned."""


def check_model(model: ObjectModel, directory: Path) -> None:
    """Raises InputError where the physics would not take the object, or takes it to be elsewhere than it is."""
    for i, piece in enumerate(model.pieces):
        if piece.vertices is not None and np.abs(piece.vertices).max() > 2 * MAX_SIZE_M:
            raise InputError(
                f"{directory}: the corners of pieces[{i}] lie far from its own frame. Import the mesh again."
            )
        if not _is_solid(piece):
            raise InputError(
                f"{directory}: pieces[{i}] is flat or degenerate; a piece must enclose a volume."
            )
    lower, upper = pieces_bounds(model.pieces)
    if np.abs(lower + upper).max() > 2 * _FRAME_TOLERANCE_M:
        raise InputError(
            f"{directory}: the pieces' bounding box is centred at {((lower + upper) / 2).round(5).tolist()}, but the "
            "origin of an object must lie at its centre. Import the mesh again."
        )
    if np.abs(upper - lower - model.size_m).max() > 2 * _FRAME_TOLERANCE_M:
        raise InputError(
            f"{directory}: size_m is {list(model.size_m)}, but the pieces measure {(upper - lower).round(5).tolist()}."
        )
    extent = np.abs(np.concatenate([v.vertices for v in model.visuals])).max()
    if extent > 2.0 * max(model.size_m):
        raise InputError(
            f"{directory}: the visible surface reaches {extent:.2f} m, far beyond the contact pieces."
        )
    corners = np.concatenate([v.vertices[v.faces] for v in model.visuals])
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area_m2 = 0.5 * float(np.linalg.norm(cross, axis=1).sum())
    if not _LEAST_M2 <= area_m2 <= _MOST_M2:
        raise InputError(
            f"{directory}: its surfaces have an area of {area_m2:.2g} m2 in all; it must be {_LEAST_M2:.2g} to "
            f"{_MOST_M2:g}. Import the mesh again, without what lies in or upon other surfaces."
        )


def _is_solid(piece: CollisionPiece) -> bool:
    from scipy.spatial import QhullError

    try:
        return piece.volume_m3 > _MIN_VOLUME_M3 and piece.thickness_m > _MIN_THICKNESS_M
    except (QhullError, ValueError):
        return False
