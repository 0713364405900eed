"""What is read as an object, the physics takes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from torc.errors import InputError
from torc.objects.files import check_model
from torc.objects.library import builtin_object_names, load_object
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh, pieces_bounds

WHERE = Path("thing")
TRIANGLE = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
ONE = np.array([[0, 1, 2]])
PLAIN = VisualMesh(TRIANGLE, ONE)
BOX = CollisionPiece("box", (0.05, 0.05, 0.05))
FAR = CollisionPiece("mesh", (), (-1e6, 0.0, 0.0), vertices=CUBE * 0.02 + (1e6, 0, 0))
"""A cube whose corners are nowhere in single precision."""
DISC = CollisionPiece("cylinder", (0.26, 2e-10), wxyz=(0.8, 0.36, 0.48, 0.0))
SHEET = CollisionPiece("mesh", vertices=CUBE * (0.1, 0.1, 1e-10) + (0, 0, 1.5))


def _object(pieces: list[CollisionPiece], visuals: list[VisualMesh]) -> ObjectModel:
    """Of the lightest kind, its origin where it should be."""
    middle = pieces_bounds(pieces).mean(axis=0)
    moved = tuple(replace(p, position=tuple(np.subtract(p.position, middle).tolist())) for p in pieces)
    lower, upper = pieces_bounds(moved)
    x, y, z = (upper - lower).tolist()
    return ObjectModel("thing", "thing", "the thing", 0.001, moved, tuple(visuals), (x, y, z))


def test_all_that_comes_with_torc_passes() -> None:
    for name in builtin_object_names():
        check_model(load_object(name), WHERE)


@pytest.mark.parametrize(
    ("piece", "told"),
    [(FAR, "lie far from its own"), (SHEET, "flat or degenerate"), (DISC, "flat or degenerate")],
)
def test_pieces_that_the_physics_refuses_are_refused_before(piece: CollisionPiece, told: str) -> None:
    thing = _object([BOX, piece], [PLAIN])
    with pytest.raises(InputError, match=told):
        check_model(thing, WHERE)


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_the_area_of_all_surfaces_is_bounded(scale: float) -> None:
    """Nothing to be seen, or so much that samples of it would fill the memory."""
    surfaces = [VisualMesh(TRIANGLE * scale, ONE)] * (50 if scale > 1 else 1)
    large = CollisionPiece("box", (0.5, 0.5, 0.5))
    with pytest.raises(InputError, match="m2 in all; it must be 9e-06 to 12"):
        check_model(_object([large], surfaces), WHERE)
