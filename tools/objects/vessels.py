"""Hollow round things: bowls, plates, mugs, cups, pans, tape rolls. Their walls are rings of convex pieces."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from tools.objects.labels import Design, rgba, wrapped_label
from tools.objects.meshes import revolve, sweep
from tools.objects.parts import LIFT_M, Parts, cylinder, polyline_capsules, ring_hulls, ring_wall, rod


def mug(radius_m: float, height_m: float, color: str, inside: str, design: Mapping[str, str]) -> Parts:
    """A straight mug with a handle on its right side (-y) and a print around it."""
    r, h, wall, floor = radius_m, height_m, 0.0045, 0.006
    label = wrapped_label(2 * np.pi * r, h, Design(**design))
    visuals = [
        revolve([(r, h - 0.002), (r, 0.002)], texture=label),
        revolve(
            [(0, floor), (r - wall, floor), (r - wall, h), (r - 0.001, h), (r, h - 0.002)], rgba=rgba(inside)
        ),
        revolve([(r, 0.002), (r - 0.002, 0), (0, 0)], rgba=rgba(color)),
    ]
    angles = np.linspace(np.pi / 2, -np.pi / 2, 17)
    reach, half = 0.028, 0.32 * h
    handle = np.stack(
        [0 * angles, -(r - 0.003) - reach * np.cos(angles), h / 2 + half * np.sin(angles)], axis=1
    )
    visuals.append(sweep(handle, 0.0055, sides=12, up=(1, 0, 0), rgba=rgba(color)))
    pieces = [cylinder(r - wall / 2, 0, floor), *ring_wall((r, r), wall, 0, h)]
    pieces += polyline_capsules(handle[::4], 0.0055)
    return Parts(pieces, visuals)


def tumbler(radii_m: tuple[float, float], height_m: float, color: str, design: Mapping[str, str]) -> Parts:
    """A cup that widens upwards; radii at the foot and at the rim."""
    (r0, r1), h, wall, floor = radii_m, height_m, 0.003, 0.004
    label = wrapped_label(np.pi * (r0 + r1), h, Design(**design))
    visuals = [
        revolve([(r1, h), (r0, 0)], texture=label),
        revolve([(0, floor), (r0 - wall, floor), (r1 - wall, h), (r1, h)], rgba=rgba(color)),
        revolve([(r0, 0), (0, 0)], rgba=rgba(color)),
    ]
    return Parts([cylinder(r0 - wall / 2, 0, floor), *ring_wall((r0, r1), wall, 0, h)], visuals)


def bowl(radii_m: tuple[float, float], height_m: float, color: str, inside: str) -> Parts:
    """An open bowl; radii at the foot and at the rim."""
    (r0, r1), h, wall, floor = radii_m, height_m, 0.005, 0.006
    visuals = [
        revolve([(r1 - 0.001, h), (r1, h - 0.0015), (r0, 0), (0, 0)], rgba=rgba(color)),
        revolve([(0, floor), (r0 - wall, floor), (r1 - wall, h), (r1 - 0.001, h)], rgba=rgba(inside)),
    ]
    return Parts([cylinder(r0 - wall / 2, 0, floor), *ring_wall((r0, r1), wall, 0, h, segments=16)], visuals)


def plate(
    radii_m: tuple[float, float], height_m: float, color: str, band: str, wall_m: float = 0.0045
) -> Parts:
    """A round plate: a flat middle and a sloping rim with a coloured band; radii of the middle and of the rim."""
    (r0, r1), h, t = radii_m, height_m, wall_m
    slope = np.array([r1 - r0, h]) / np.hypot(r1 - r0, h)
    back, up = t * slope[1], t * slope[0]  # across the slope, from the outer to the inner edge
    inner_low, inner_top, outer_top = (r0 - back, up), (r1 - back, h), (r1, h - up)
    floor = max(up, 0.0035)
    edge = (inner_low[0] + (floor - up) * (r1 - r0) / (h - up), floor)
    middle = (0.45 * edge[0] + 0.55 * inner_top[0], 0.45 * edge[1] + 0.55 * inner_top[1])
    visuals = [
        revolve([(0, floor), edge], segments=56, rgba=rgba(color)),
        revolve([edge, middle], segments=56, rgba=rgba(color)),
        revolve([middle, inner_top], segments=56, rgba=rgba(band)),
        revolve([inner_top, outer_top, (r0, 0), (0, 0)], segments=56, rgba=rgba(color)),
    ]
    rim = ring_hulls([(r0, LIFT_M), inner_low, outer_top, inner_top], segments=20)
    return Parts([cylinder(r0, 0, floor), *rim], visuals)


def teacup(radii_m: tuple[float, float], height_m: float, color: str, inside: str, band: str) -> Parts:
    """A round-bottomed cup with a small handle on its right side (-y); radii of the foot and of the rim."""
    (r0, r1), h, wall, floor = radii_m, height_m, 0.0036, 0.006

    def outer(z: float, less: float = 0.0) -> tuple[float, float]:
        return r1 - (r1 - r0) * (1 - z / h) ** 2 - less, z

    stripe = 0.76 * h
    visuals = [
        revolve([outer(z) for z in np.linspace(h, stripe, 4)], rgba=rgba(band)),
        revolve([*(outer(z) for z in np.linspace(stripe, 0, 9)), (0, 0)], rgba=rgba(color)),
        revolve(
            [(0, floor), *(outer(z, wall) for z in np.linspace(floor, h, 10)), outer(h)], rgba=rgba(inside)
        ),
    ]
    angles = np.linspace(np.pi / 2, -np.pi / 2, 17)
    z = 0.56 * h + 0.28 * h * np.sin(angles)
    roots = np.array([outer(float(height), 0.4 * wall)[0] for height in z])
    handle = np.stack([0 * z, -roots - 0.020 * np.cos(angles), z], axis=1)
    visuals.append(sweep(handle, 0.0042, sides=12, up=(1, 0, 0), rgba=rgba(band)))
    pieces = [cylinder(r0 - wall / 2, 0, floor), *polyline_capsules(handle[::4], 0.0042)]
    for low, high in pairwise((LIFT_M, 0.28 * h, 0.6 * h, h)):
        pieces += ring_hulls([outer(low), outer(low, wall), outer(high), outer(high, wall)], segments=10)
    return Parts(pieces, visuals)


def pan(
    radii_m: tuple[float, float],
    height_m: float,
    handle_m: tuple[float, float, float],
    outside: str,
    inside: str,
    grip: str,
) -> Parts:
    """A saucepan or a frying pan; radii at the base and the rim.

    `handle_m`: its length, its radius, and how far its end, on the right side (-y), is above its root.
    """
    (r0, r1), h, wall, floor = radii_m, height_m, 0.0035, 0.007
    length, thick, rise = handle_m
    visuals = [
        revolve([(r1 - 0.001, h), (r1, h - 0.001), (r0, 0), (0, 0)], segments=48, rgba=rgba(outside)),
        revolve([(r1 - wall, h), (r1 - 0.001, h)], segments=48, rgba=rgba(outside)),
        revolve([(0, floor), (r0 - wall, floor), (r1 - wall, h)], segments=48, rgba=rgba(inside)),
    ]
    root = np.array([0.0, -(r1 - wall / 2), h - 1.2 * thick])
    neck = root + np.array([0.0, -0.25 * length, 0.25 * rise])
    end = root + np.array([0.0, -length, rise])
    bracket, held = np.linspace(root, neck, 4), np.linspace(neck, end, 9)
    shape = thick * np.array([0.72, 0.92, 1.0, 1.0, 1.0, 1.0, 1.0, 0.95, 0.7])
    visuals += [
        sweep(bracket, 0.6 * thick, sides=14, rgba=rgba(outside)),
        sweep(held, shape, sides=18, rgba=rgba(grip)),
    ]
    wall_pieces = ring_wall((r0, r1), wall, LIFT_M, h, segments=16)
    pieces = [cylinder(r0 - wall / 2, 0, floor, relative_density=2.0), *wall_pieces]
    pieces += [
        rod(root, neck, 0.6 * thick, relative_density=0.5),
        rod(neck, end, thick, relative_density=0.5),
    ]
    return Parts(pieces, visuals)


def tape_roll(radius_m: float, hole_m: float, width_m: float, color: str, core: str) -> Parts:
    """A roll of tape, lying flat: outer radius, radius of its hole, width of the tape."""
    r, q, w = radius_m, hole_m, width_m
    turns = np.full((64, 8, 3), 0, dtype=np.uint8) + np.array(
        [int(255 * c) for c in rgba(color)[:3]], dtype=np.uint8
    )
    turns[::4] = (turns[::4] * 0.88).astype(np.uint8)
    visuals = [
        revolve([(r, w), (r, 0)], rgba=rgba(color)),
        revolve([(q + 0.003, w), (r, w)], texture=turns),
        revolve([(r, 0), (q + 0.003, 0)], texture=turns),
        revolve([(q + 0.003, 0), (q, 0), (q, w), (q + 0.003, w)], rgba=rgba(core)),
    ]
    return Parts(ring_wall((r, r), r - q, 0, w), visuals)
