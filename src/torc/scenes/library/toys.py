"""Toys."""

import numpy as np

from torc.geometry.transforms import rotation_about
from torc.scenes.library.bottles import LYING
from torc.scenes.library.labels import rgb, rgba
from torc.scenes.library.meshes import arc, box_mesh, facetted, loft, moved, revolve
from torc.scenes.library.parts import Parts, box, hull, rod
from torc.scenes.models import CollisionPiece


def toy_brick(studs: tuple[int, int], color: str, pitch_m: float = 0.016, height_m: float = 0.019) -> Parts:
    """A plug-together brick: studs along x and y."""
    nx, ny = studs
    size = (nx * pitch_m, ny * pitch_m, height_m)
    r, stud = 0.3 * pitch_m, 0.0035
    visuals, pieces = [box_mesh(size, rgba=rgba(color))], [box(size)]
    for i in range(nx):
        for j in range(ny):
            x, y, z = (i + 0.5 - nx / 2) * pitch_m, (j + 0.5 - ny / 2) * pitch_m, height_m / 2
            knob = revolve(
                [(0, stud), (r - 0.0004, stud), (r, stud - 0.0004), (r, 0)], segments=20, rgba=rgba(color)
            )
            visuals.append(moved(knob, position=(x, y, z)))
            pieces.append(rod((x, y, z), (x, y, z + stud), r))
    return Parts(pieces, visuals)


def ball(radius_m: float, colors: tuple[str, ...]) -> Parts:
    """A rubber ball with coloured sectors."""
    r = radius_m
    sectors = np.array([rgb(colors[k % len(colors)]) for k in range(6)], dtype=np.uint8)
    texture = np.tile(np.repeat(sectors, 32, axis=0), (64, 1, 1))
    texture[:5], texture[-5:] = rgb(colors[0]), rgb(colors[0])
    profile = [(x if x > 1e-9 else 0.0, z) for x, z in arc((0.0, 0.0), r, np.pi / 2, -np.pi / 2, 24)]
    return Parts([CollisionPiece("sphere", (r,))], [revolve(profile, texture=texture)])


def toy_car(length_m: float, color: str, windows: str = "#bcd8ea") -> Parts:
    """A toy car that drives towards -x: body, cabin, four wheels."""
    s = length_m / 0.10
    wheel, track = 0.012 * s, 0.044 * s
    body, cabin_low, cabin_high = (
        (length_m, 0.042 * s, 0.018 * s),
        (0.056 * s, 0.038 * s),
        (0.036 * s, 0.032 * s),
    )
    z = 0.008 * s + body[2] / 2
    floor, roof = z + body[2] / 2, z + body[2] / 2 + 0.016 * s
    rings = np.array([_corners(cabin_high, roof, 0.008 * s), _corners(cabin_low, floor, 0.008 * s)])
    visuals = [
        box_mesh(body, (0, 0, z), rgba=rgba(color)),
        facetted(loft(rings, rgba=rgba(windows))),
        box_mesh((cabin_high[0], cabin_high[1], 0.0012), (0.008 * s, 0, roof), rgba=rgba(color)),
    ]
    pieces = [box(body, (0, 0, z)), hull(rings.reshape(-1, 3))]
    for x in (-0.3 * length_m, 0.3 * length_m):
        for side in (-1, 1):
            inner, outer = side * (track / 2 - 0.008 * s), side * track / 2
            ends = (x, min(inner, outer), wheel), (x, max(inner, outer), wheel)
            pieces.append(rod(*ends, wheel))
            visuals += _wheel(x, outer, wheel, abs(outer - inner), side)
    for y in (-0.014 * s, 0.014 * s):
        lamp = revolve(
            [(0, 0.0012), (0.004 * s, 0.0012), (0.004 * s, 0), (0, 0)], segments=14, rgba=rgba("#fff3b0")
        )
        visuals.append(moved(lamp, rotation_about((0, 1, 0), -np.pi / 2), (-length_m / 2, y, z)))
    return Parts(pieces, visuals)


def _wheel(x: float, y: float, radius: float, width: float, side: int):  # type: ignore[no-untyped-def]
    tyre = revolve([(0, 0), (radius, 0), (radius, -width), (0, -width)], segments=24, rgba=rgba("#222222"))
    hub = revolve([(0, 0.0008), (0.5 * radius, 0.0008), (0.5 * radius, 0)], segments=16, rgba=rgba("#d8d8d8"))
    R = LYING if side > 0 else LYING @ rotation_about((1, 0, 0), np.pi)
    return [moved(mesh, R, (x, y, radius)) for mesh in (tyre, hub)]


def _corners(size: tuple[float, float], z: float, dx: float) -> list[tuple[float, float, float]]:
    """A rectangle, counter-clockwise from above."""
    x, y = size[0] / 2, size[1] / 2
    return [(dx + a * x, b * y, z) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
