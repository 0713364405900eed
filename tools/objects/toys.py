"""Toys."""

import numpy as np

from tools.objects.bottles import LYING
from tools.objects.labels import rgb, rgba
from tools.objects.meshes import (
    arc,
    box_mesh,
    ellipsoid_mesh,
    facetted,
    loft,
    moved,
    prism_mesh,
    revolve,
)
from tools.objects.parts import Parts, box, cylinder, hull, prism, ring_points, rod, turned
from torc.geometry.transforms import rotation_about
from torc.objects.models import CollisionPiece, VisualMesh


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


def _wheel(x: float, y: float, radius: float, width: float, side: int) -> list[VisualMesh]:
    tyre = revolve([(0, 0), (radius, 0), (radius, -width), (0, -width)], segments=24, rgba=rgba("#222222"))
    hub = revolve([(0, 0.0008), (0.5 * radius, 0.0008), (0.5 * radius, 0)], segments=16, rgba=rgba("#d8d8d8"))
    R = LYING if side > 0 else LYING @ rotation_about((1, 0, 0), np.pi)
    return [moved(mesh, R, (x, y, radius)) for mesh in (tyre, hub)]


def _corners(size: tuple[float, float], z: float, dx: float) -> list[tuple[float, float, float]]:
    """A rectangle, counter-clockwise from above."""
    x, y = size[0] / 2, size[1] / 2
    return [(dx + a * x, b * y, z) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


def toy_plane(length_m: float, color: str, wing: str) -> Parts:
    """A propeller plane on three wheels that flies towards -x."""
    s, half = length_m / 0.14, 0.5 * length_m
    z, thick, wheel = 0.034 * s, 0.006 * s, 0.010 * s
    visuals, pieces = _fuselage(half, z, s, color)
    span, root, edge = 0.5 * length_m, -0.34 * half, 0.14 * half
    wings = [(edge, -span), (edge, span), (root + 0.014 * s, span), (root, 0.3 * span)]
    wings += [(root, -0.3 * span), (root + 0.014 * s, -span)]
    tail = [(half, -0.4 * span), (half, 0.4 * span), (0.72 * half, 0.3 * span), (0.72 * half, -0.3 * span)]
    for flat, low in ((wings, z - 0.006 * s), (tail, z - 0.5 * thick)):
        visuals.append(prism_mesh(flat, low, low + thick, rgba=rgba(wing)))
        pieces.append(prism(flat, low, low + thick))
    upright = [(0.70 * half, 0.0), (half, 0.0), (half, 0.034 * s), (0.86 * half, 0.034 * s)]
    fin = np.array([[(x, y, z + h) for x, h in upright] for y in (thick / 2, -thick / 2)])
    visuals.append(facetted(loft(fin[:, ::-1], rgba=rgba(wing))))
    pieces.append(hull(fin.reshape(-1, 3)))
    for x, y in ((-0.66 * half, 0.0), (0.1 * half, 0.028 * s), (0.1 * half, -0.028 * s)):
        strut, at = (0.005 * s, 0.004 * s, z - wheel), (x, y, (z + wheel) / 2)
        tyre = (x, y - 0.003 * s, wheel), (x, y + 0.003 * s, wheel)
        visuals.append(box_mesh(strut, at, rgba=rgba("#9aa0a6")))
        visuals += _wheel(x, tyre[1][1], wheel, 0.006 * s, 1) + _wheel(x, tyre[0][1], wheel, 0.006 * s, -1)
        pieces += [box(strut, at), rod(*tyre, wheel)]
    return Parts(pieces, visuals)


def _fuselage(half: float, z: float, s: float, color: str) -> tuple[list[VisualMesh], list[CollisionPiece]]:
    """The body of a plane with its cabin and its propeller."""
    x = np.array([-0.94, -0.88, -0.60, -0.10, 0.35, 0.72, 1.0]) * half
    radii = np.array([0.009, 0.0145, 0.0165, 0.0160, 0.0125, 0.008, 0.005]) * s
    nose_up = rotation_about((0, 1, 0), -np.pi / 2)
    rings = np.stack([ring_points(r, -a, 20) @ nose_up.T + [0, 0, z] for a, r in zip(x, radii)])
    cabin, glass = (-0.06 * half, 0.0, z + 0.012 * s), (0.018 * s, 0.010 * s, 0.011 * s)
    blade, hub = (0.004 * s, 0.056 * s, 0.007 * s), (-0.95 * half, 0.0, z)
    visuals = [
        loft(rings, rgba=rgba(color)),
        moved(ellipsoid_mesh(glass, rgba=rgba("#bcd8ea")), position=cabin),
        box_mesh(blade, hub, rgba=rgba("#3a3a3a")),
    ]
    pieces = [hull(rings[:4].reshape(-1, 3)), hull(rings[3:].reshape(-1, 3))]
    pieces += [CollisionPiece("ellipsoid", glass, cabin), box(blade, hub)]
    return visuals, pieces


def wooden_block(shape: str, size_m: tuple[float, float, float], color: str) -> Parts:
    """A building block: depth, width, height; a "cuboid", a "cylinder", a "roof" or an "arch" (open along x)."""
    depth, width, h = size_m
    if shape == "cuboid":
        return Parts([box(size_m)], [box_mesh(size_m, rgba=rgba(color))])
    if shape == "cylinder":
        profile = [(0.0, h), (width / 2, h), (width / 2, 0.0), (0.0, 0.0)]
        return Parts([cylinder(width / 2, 0, h)], [revolve(profile, rgba=rgba(color))])
    outlines = [[(-width / 2, 0.0), (width / 2, 0.0), (0.0, h)]] if shape == "roof" else _arch(width, h)
    pieces = [prism(outline, -depth / 2, depth / 2) for outline in outlines]
    visuals = [prism_mesh(outline, -depth / 2, depth / 2, rgba=rgba(color)) for outline in outlines]
    return turned(Parts(pieces, visuals), np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))


def _arch(width: float, height: float) -> list[list[tuple[float, float]]]:
    """Convex outlines that make up a rectangle without a half disc at the middle of its lower side."""
    corner = np.arctan2(height, width / 2)
    a = np.sort(np.concatenate([np.pi * np.arange(11) / 10, [corner, np.pi - corner]]))
    ray = np.stack([np.cos(a), np.sin(a)], axis=1)
    reach = np.minimum(width / 2 / np.maximum(np.abs(ray[:, 0]), 1e-9), height / np.maximum(ray[:, 1], 1e-9))
    inner, outer = 0.28 * width * ray, reach[:, None] * ray
    return [[*outer[k : k + 2].tolist(), *inner[k : k + 2][::-1].tolist()] for k in range(len(a) - 1)]
