"""Objects to learn from that are nothing: tools, rings, vessels and figures of random parts in random paint.

The network knew large objects of kinds that it had trained on in 97 of 100 cases, of other kinds in 85: those fell into
their parts, a spatula into blade and handle, or a toy plane into body and wings. What it must learn is that parts that
are joined are one thing, whatever they look like; so there must be many things that nobody has seen before.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypedDict

import numpy as np
from jaxtyping import Float, UInt8

from tools.eyes.looks import pattern, random_color
from tools.objects.meshes import box_mesh, moved, revolve
from tools.objects.parts import Parts, box, centered, frustum, ring_hulls, turned, vec3
from torc.geometry.transforms import rotation_about
from torc.objects.models import CollisionPiece, ObjectModel, Quat, VisualMesh
from torc.objects.object_files import save_object

KINDS = 80
"""They are counted as so many kinds, so that scenes hold about as many of them as of real things."""
_PLAIN = 0.5
_DENSITY = (250.0, 1200.0)
_X, _Y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])


def make_up(store: Path, count: int, seed: int) -> list[str]:
    """So many objects in a store; their names. Those that are there stay."""
    names = []
    for k in range(count):
        name = f"made_up_{k:04d}"
        if not (store / name).exists():
            rng = np.random.default_rng([seed, k])
            save_object(made_up(name, f"made_up_{k % KINDS}", rng), store / name)
        names.append(name)
    return names


def made_up(name: str, kind: str, rng: np.random.Generator) -> ObjectModel:
    """One object."""
    parts = _FAMILIES[int(rng.integers(len(_FAMILIES)))](rng)
    pieces, visuals, size_m = centered(parts)
    volume = sum(p.volume_m3 for p in pieces)
    return ObjectModel(
        name=name,
        kind=kind,
        description=f"the thing {name}",
        mass_kg=float(np.clip(volume * rng.uniform(*_DENSITY), 0.005, 0.8)),
        pieces=pieces,
        visuals=visuals,
        size_m=size_m,
    )


def _tool(rng: np.random.Generator) -> Parts:
    """A handle of one or several pieces, straight or bent, with something at its end, straight or cranked."""
    length, radius = rng.uniform(0.06, 0.15), rng.uniform(0.004, 0.013)
    parts, end = [_bar(rng, length, radius)], length
    bend = 0.0 if rng.random() < 0.5 else rng.normal(0, 0.25)
    for _ in range(int(rng.choice([0, 1, 3], p=[0.3, 0.5, 0.2]))):
        neck = rng.uniform(0.015, 0.06)
        radius = max(radius * rng.uniform(0.35, 1.0), 0.002)
        # What is there turns about the joint, so that what comes next goes straight on.
        turned_back = turned(_shifted(_together(parts), (0, 0, -end)), rotation_about(_X, bend))
        parts = [turned_back, _shifted(_bar(rng, neck, radius), (0, 0, -0.001))]
        end = neck
    size = rng.uniform(0.012, 0.04)
    heads: tuple[Callable[[], Parts], ...] = (
        lambda: _block(
            rng, (size * rng.uniform(1, 2), rng.uniform(0.003, 0.012), size * rng.uniform(1, 2.5))
        ),
        lambda: _across(_bar(rng, size * rng.uniform(1.5, 3), rng.uniform(0.4, 1) * size)),
        lambda: _ball(rng, (size, size * rng.uniform(0.3, 1), size * rng.uniform(0.8, 1.6))),
        lambda: _upright(_ring(rng, size * rng.uniform(0.8, 1.5))),
        lambda: _prongs(rng, size),
        lambda: _prongs(rng, size, closed=True),
    )
    head = heads[int(rng.integers(len(heads)))]()
    if rng.random() < 0.5:
        head = turned(head, rotation_about(_X, rng.normal(0, 0.5)))
    low = min(v.vertices[:, 2].min() for v in head.visuals)
    parts.append(_shifted(head, (0, 0, end - low - 0.002)))
    return turned(_together(parts), rotation_about(_Y, np.pi / 2))


def _prongs(rng: np.random.Generator, size: float, closed: bool = False) -> Parts:
    """A fork, a comb or, closed at its end, a plate with slots."""
    count, length = int(rng.integers(2, 6)), size * rng.uniform(1, 2.5)
    thick, width = rng.uniform(0.002, 0.006), 2 * size
    places = np.linspace(-0.5, 0.5, count) * width
    bars = [_shifted(_block(rng, (thick, thick, length)), (x, 0, length / 2)) for x in places]
    painted = bars[0].visuals[0].rgba
    same = [
        Parts(b.pieces, [replace(v, rgba=painted, texture=None, uv=None) for v in b.visuals]) for b in bars
    ]
    root = _block(rng, (width + thick, thick, rng.uniform(0.005, 0.02)))
    return _together([*same, root, *([_shifted(root, (0, 0, length))] if closed else [])])


def _ring(rng: np.random.Generator, outer: float | None = None) -> Parts:
    """A roll, a hoop, or a tyre: other paint inside than outside, or bands."""
    outer = rng.uniform(0.018, 0.06) if outer is None else outer
    inner, height = outer * rng.uniform(0.4, 0.85), float(np.clip(outer * rng.uniform(0.2, 1.3), 0.006, 0.06))
    section = [(outer, 0.0), (outer, height), (inner, height), (inner, 0.0)]
    middle = inner + (outer - inner) * rng.uniform(0.2, 0.8)
    walls = [
        ([(outer, height), (outer, 0.0)], _paint(rng)),
        ([(middle, height), (outer, height)], side := _paint(rng)),
        ([(outer, 0.0), (middle, 0.0)], side),
        ([(inner, height), (middle, height)], core := _paint(rng)),
        ([(middle, 0.0), (inner, 0.0)], core),
        ([(inner, 0.0), (inner, height)], core),
    ]
    return Parts(ring_hulls(section, 14), [revolve(p, **paint) for p, paint in walls])


def _vessel(rng: np.random.Generator) -> Parts:
    """A hollow thing with a bottom, and with handles maybe."""
    top, height = rng.uniform(0.02, 0.055), rng.uniform(0.02, 0.12)
    low, wall = top * rng.uniform(0.55, 1.0), rng.uniform(0.002, 0.006)
    floor = rng.uniform(0.003, 0.008)
    section = [(low, 0.0), (top, height), (top - wall, height), (low - wall, 0.0)]
    pieces = [*ring_hulls(section, 12), frustum(low - wall / 2, 0.0, low - wall / 2, floor)]
    inside = low - wall + (top - low) * floor / height
    outer, within = _paint(rng), _paint(rng)
    visuals = [
        revolve([(top - wall, height), (top, height), (low, 0.0), (0.0, 0.0)], **outer),
        revolve([(0.0, floor), (inside, floor), (top - wall, height)], **within),
    ]
    parts = [Parts(pieces, visuals)]
    reach, bar = rng.uniform(0.012, 0.03), rng.uniform(0.003, 0.007)
    for side in (1, -1)[: int(rng.integers(0, 3))]:
        grip = _block(rng, (reach, 2 * bar, 2 * bar))
        at = height * rng.uniform(0.4, 0.9)
        middle = low + (top - low) * at / height
        arms = [_shifted(grip, (side * (middle + reach / 2 - 0.002), 0, at))]
        if rng.random() < 0.7:
            drop = at * rng.uniform(0.4, 0.9)
            upright = _block(rng, (2 * bar, 2 * bar, drop))
            arms.append(_shifted(upright, (side * (middle + reach - bar), 0, at - drop / 2)))
        parts += arms
    return _together(parts)


def _figure(rng: np.random.Generator) -> Parts:
    """A body with wings, wheels, ears or knobs on both sides."""
    x, y, z = rng.uniform(0.02, 0.06), rng.uniform(0.012, 0.035), rng.uniform(0.01, 0.04)
    body = _ball(rng, (x, y, z)) if rng.random() < 0.4 else _block(rng, (2 * x, 2 * y, 2 * z))
    parts = [body]
    for _ in range(int(rng.integers(1, 4))):
        at, up, small = rng.uniform(-0.8, 0.8) * x, rng.uniform(-0.7, 0.7) * z, rng.uniform(0.006, 0.018)
        kind = int(rng.integers(3))
        if kind == 0:
            span = rng.uniform(0.015, 0.06)
            part = _block(rng, (rng.uniform(0.01, 0.04), span, rng.uniform(0.003, 0.008)))
            out = y + span / 2 - 0.004
        elif kind == 1:
            part = turned(
                _shifted(_bar(rng, small, small), (0, 0, -small / 2)), rotation_about(_X, np.pi / 2)
            )
            out = y + small / 2
        else:
            part = _ball(rng, tuple(small * rng.uniform(0.6, 1.4, 3)))
            out = y
        inward = 0.3 if body.pieces[0].kind == "ellipsoid" else 0.0
        out -= inward * y
        parts += [_shifted(part, (at, side * out, up)) for side in (1, -1)]
    if rng.random() < 0.6:
        parts.append(
            _shifted(_ball(rng, tuple(rng.uniform(0.4, 1.0, 3) * min(y, z, x) * 1.2)), (x, 0, 0.6 * z))
        )
    return _together(parts)


def _stack(rng: np.random.Generator) -> Parts:
    """Rounds or blocks on top of each other: bottles, lamps, jars with lids."""
    parts, z = [], 0.0
    radius = rng.uniform(0.012, 0.04)
    for _ in range(int(rng.integers(2, 6))):
        height = float(rng.uniform(0.006, 0.06))
        parts.append(_shifted(_bar(rng, height, radius), (0, 0, z)))
        z += height - 0.0005
        radius = float(np.clip(radius * rng.uniform(0.45, 1.5), 0.005, 0.045))
        if z > 0.16:
            break
    return _together(parts)


def _frame(rng: np.random.Generator) -> Parts:
    """Bars that meet at angles: L, T, U and the like."""
    parts = [_bar(rng, rng.uniform(0.05, 0.15), rng.uniform(0.005, 0.014))]
    for _ in range(int(rng.integers(1, 4))):
        bar = _bar(rng, rng.uniform(0.025, 0.08), rng.uniform(0.005, 0.014))
        tilt = rotation_about(_X, rng.choice([-0.5, 0.5]) * np.pi + rng.normal(0, 0.2))
        low, high = parts[0].visuals[0].vertices[:, 2].min(), parts[0].visuals[0].vertices[:, 2].max()
        at = float(rng.choice([low + 0.006, high - 0.006, rng.uniform(low, high)]))
        parts.append(_shifted(turned(bar, tilt), (0, 0, at)))
    return turned(_together(parts), rotation_about(_Y, np.pi / 2))


def _assembly(rng: np.random.Generator) -> Parts:
    """Bars, plates, blocks and balls, each stuck on one before it, anywhere and at any angle."""
    scale = rng.uniform(0.5, 1.2)
    makers: tuple[Callable[[], Parts], ...] = (
        lambda: _bar(rng, scale * rng.uniform(0.03, 0.14), scale * rng.uniform(0.004, 0.014)),
        lambda: _block(rng, (*(scale * rng.uniform(0.02, 0.09, 2)), rng.uniform(0.003, 0.008))),
        lambda: _block(rng, tuple(scale * rng.uniform(0.012, 0.05, 3))),
        lambda: _ball(rng, tuple(scale * rng.uniform(0.008, 0.032, 3))),
    )
    found: list[Parts] = []
    for _ in range(int(rng.integers(2, 6))):
        part = makers[int(rng.integers(len(makers)))]()
        square = rng.random() < 0.6  # most things are made at right angles
        part = turned(part, _quarter_turns(rng) if square else rotation_about(rng.standard_normal(3), 3.0))
        if found:
            on = found[int(rng.integers(len(found)))]
            part = _stuck_on(on, part, rng)
        found.append(part)
    return _together(found)


def _quarter_turns(rng: np.random.Generator) -> Float[np.ndarray, "3 3"]:
    turn = rotation_about(_X, 0.5 * np.pi * int(rng.integers(2)))
    return turn @ rotation_about(_Y, 0.5 * np.pi * int(rng.integers(2)))


def _stuck_on(on: Parts, part: Parts, rng: np.random.Generator) -> Parts:
    """The part moved so that it sinks a little into another one, somewhere at both their surfaces."""
    surface, own = (np.concatenate([v.vertices for v in p.visuals]) for p in (on, part))
    out = surface[int(rng.integers(len(surface)))] - surface.mean(axis=0)
    facing = own[int(np.argmin(own @ out))] if rng.random() < 0.5 else own[int(rng.integers(len(own)))]
    # Both are convex: what lies between a corner and the middle is inside.
    at = surface.mean(axis=0) + rng.uniform(0.3, 0.9) * out
    return _shifted(part, at - (own.mean(axis=0) + rng.uniform(0.5, 0.9) * (facing - own.mean(axis=0))))


_FAMILIES = (*3 * (_tool,), _ring, _vessel, *2 * (_figure,), _stack, _frame, *3 * (_assembly,))


class _Paint(TypedDict, total=False):
    rgba: Quat
    texture: UInt8[np.ndarray, "h w 3"]


def _paint(rng: np.random.Generator) -> _Paint:
    if rng.random() < _PLAIN:
        r, g, b = (float(v) for v in random_color(rng))
        return {"rgba": (r, g, b, 1.0)}
    side = int(rng.choice([48, 96]))
    return {"texture": pattern(side, side, rng)}


def _bar(rng: np.random.Generator, length: float, radius: float) -> Parts:
    """Round, tapered or square, along z from 0."""
    if rng.random() < 0.35:
        flat = rng.uniform(0.5, 1.0)
        return _shifted(_block(rng, (2 * radius, 2 * radius * flat, length)), (0, 0, length / 2))
    end = radius * (rng.uniform(0.6, 1.0) if rng.random() < 0.5 else 1.0)
    profile = [(0.0, length), (end, length), (radius, 0.0), (0.0, 0.0)]
    return Parts([frustum(radius, 0.0, end, length)], [revolve(profile, segments=24, **_paint(rng))])


def _block(rng: np.random.Generator, size: tuple[float, ...]) -> Parts:
    return Parts([box(size)], [box_mesh(size, **_paint(rng))])


def _ball(rng: np.random.Generator, half: tuple[float, ...]) -> Parts:
    x, y, z = (max(float(v), 0.003) for v in half)
    turn = np.linspace(np.pi / 2, -np.pi / 2, 15)
    profile = [(float(max(np.cos(a), 0.0)), z * float(np.sin(a))) for a in turn]
    surface = revolve(profile, segments=24, axes=(x, y), **_paint(rng))
    return Parts([CollisionPiece("ellipsoid", (x, y, z))], [surface])


def _across(parts: Parts) -> Parts:
    """A bar along z, laid across with its middle at the origin."""
    middle = 0.5 * max(v.vertices[:, 2].max() for v in parts.visuals)
    return turned(_shifted(parts, (0, 0, -middle)), rotation_about(_Y, np.pi / 2))


def _upright(parts: Parts) -> Parts:
    return turned(parts, rotation_about(_X, np.pi / 2))


def _together(parts: list[Parts]) -> Parts:
    pieces = [p for part in parts for p in part.pieces]
    visuals: list[VisualMesh] = [v for part in parts for v in part.visuals]
    return Parts(pieces, visuals)


def _shifted(parts: Parts, by: tuple[float, ...] | Float[np.ndarray, "3"]) -> Parts:
    step = np.asarray(by, dtype=float)
    pieces = [replace(p, position=vec3(np.array(p.position) + step)) for p in parts.pieces]
    return Parts(pieces, [moved(v, np.eye(3), step) for v in parts.visuals])
