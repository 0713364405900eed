"""What is read as an object, the physics takes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from torc.errors import InputError
from torc.objects.checks import check_model, visible_area_m2
from torc.objects.library import builtin_object_names, load_object
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh, pieces_bounds
from torc.sim.object_check import world_with

WHERE = Path("thing")
TRIANGLE = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
ONE = np.array([[0, 1, 2]])
PLAIN = VisualMesh(TRIANGLE, ONE)


def _object(pieces: list[CollisionPiece], visuals: list[VisualMesh]) -> ObjectModel:
    """Of the lightest kind, its origin where it should be."""
    middle = pieces_bounds(pieces).mean(axis=0)
    moved = tuple(replace(p, position=tuple(np.subtract(p.position, middle).tolist())) for p in pieces)
    lower, upper = pieces_bounds(moved)
    x, y, z = (upper - lower).tolist()
    return ObjectModel("thing", "thing", "the thing", 0.001, moved, tuple(visuals), (x, y, z))


def _box(half_m: float = 0.05) -> CollisionPiece:
    return CollisionPiece("box", (half_m, half_m, half_m))


def test_all_that_comes_with_torc_passes() -> None:
    for name in builtin_object_names():
        check_model(load_object(name), WHERE)


@pytest.mark.parametrize(
    ("vertices", "area_m2"),
    [
        (TRIANGLE, 5e-5),
        (TRIANGLE * 1e-3, 5e-11),
        (TRIANGLE * 1e-5, 0.0),
        (TRIANGLE * 0, 0.0),
        (TRIANGLE * (1, 0, 0), 0.0),
        (TRIANGLE * (30, 1e-6, 1), 0.0),
        (TRIANGLE * (30, 1e-3, 1), 1.5e-6),
        (TRIANGLE * (1, 1e-6, 1) + 1.0, 0.0),  # not in single precision
    ],
)
def test_the_area_of_points_and_lines_is_none(vertices: np.ndarray, area_m2: float) -> None:
    assert visible_area_m2(vertices, ONE) == pytest.approx(area_m2, rel=1e-3, abs=0.0)


@pytest.mark.parametrize("vertices", [TRIANGLE * 0, TRIANGLE * (1, 0, 0), TRIANGLE * (1, 1e-12, 1)])
def test_surfaces_that_the_physics_refuses_are_refused_before(vertices: np.ndarray) -> None:
    thing = _object([_box()], [PLAIN, VisualMesh(vertices, ONE)])
    with pytest.raises(InputError, match="MuJoCo does not accept"):
        world_with(thing)
    with pytest.raises(InputError, match=r"thing: visuals\[1\] has next to no area.*Leave it out"):
        check_model(thing, WHERE)


FAR = CollisionPiece("mesh", (), (-1e6, 0.0, 0.0), vertices=CUBE * 0.02 + (1e6, 0, 0))
"""A cube whose corners are nowhere in single precision."""
NEEDLE = CollisionPiece("cylinder", (1e-8, 0.2), wxyz=(0.8, 0.36, 0.48, 0.0))
DISC = CollisionPiece("cylinder", (0.26, 2e-10), wxyz=(0.8, 0.36, 0.48, 0.0))
SHEET = CollisionPiece("mesh", vertices=CUBE * (0.1, 0.1, 1e-10) + (0, 0, 1.5))


@pytest.mark.parametrize("piece", [FAR, NEEDLE, SHEET])
def test_pieces_that_the_physics_refuses_are_refused_before(piece: CollisionPiece) -> None:
    thing = _object([_box(), piece] if piece is not NEEDLE else [piece], [PLAIN])
    with pytest.raises(InputError, match="MuJoCo does not accept"):
        world_with(thing)
    with pytest.raises(
        InputError, match=r"pieces\[\d\] is flat or degenerate|pieces\[1\] lie far from its own"
    ):
        check_model(thing, WHERE)


@pytest.mark.parametrize("piece", [DISC, CollisionPiece("sphere", (1e-16,))])
def test_primitives_too_must_enclose_a_volume(piece: CollisionPiece) -> None:
    with pytest.raises(InputError, match=r"pieces\[1\] is flat"):
        check_model(_object([_box(), piece], [PLAIN]), WHERE)


@pytest.mark.parametrize(("scale", "area"), [(0.01, "5e-09"), (700.0, "25")])
def test_the_area_of_all_surfaces_is_bounded(scale: float, area: str) -> None:
    """Nothing to be seen, or so much that samples of it would fill the memory."""
    surface = VisualMesh(TRIANGLE * scale / (7 if scale > 1 else 1), ONE)
    count = 50 if scale > 1 else 1
    with pytest.raises(InputError, match=rf"an area of {area} m2 in all; it must be 9e-06 to 12"):
        check_model(_object([_box(0.4)], [surface] * count), WHERE)


def _random_piece(rng: np.random.Generator) -> CollisionPiece:
    """Often as thin as a piece may just be, in any direction."""
    thin = np.where(rng.random(3) < 0.5, 10 ** rng.uniform(-5.4, -4.0, 3), 10 ** rng.uniform(-3.0, -0.5, 3))
    q = rng.normal(size=4)
    w, x, y, z = (q / np.linalg.norm(q)).tolist()
    kind = rng.choice(["box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"])
    count = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "ellipsoid": 3, "mesh": 0}[kind]
    vertices = None
    if kind == "mesh":
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        vertices = (rng.uniform(-1, 1, (12, 3)) * thin) @ turn + rng.uniform(-1.5, 1.5, 3)
    density = float(10 ** rng.uniform(-3, 3))
    return CollisionPiece(
        kind, tuple(thin[:count].tolist()), (0.0, 0.0, 0.0), (w, x, y, z), vertices, density
    )


def _random_surface(rng: np.random.Generator) -> VisualMesh:
    """Often as narrow as a surface may just be."""
    narrow = np.where(rng.random(3) < 0.6, 10 ** rng.uniform(-7.0, -5.0, 3), 10 ** rng.uniform(-4.0, -1.0, 3))
    vertices = (rng.uniform(-1, 1, (rng.integers(3, 12), 3)) * narrow) @ np.linalg.qr(
        rng.normal(size=(3, 3))
    )[0]
    return VisualMesh(vertices, rng.integers(0, len(vertices), (rng.integers(1, 20), 3)))


def test_whatever_passes_the_physics_takes() -> None:
    rng = np.random.default_rng(0)
    taken = refused = 0
    for _ in range(600):
        pieces = [_random_piece(rng) for _ in range(rng.integers(1, 4))]
        thing = _object(pieces, [replace(PLAIN), _random_surface(rng)])
        try:
            check_model(thing, WHERE)
        except InputError:
            refused += 1
            continue
        world_with(thing)
        taken += 1
    assert min(taken, refused) > 100
