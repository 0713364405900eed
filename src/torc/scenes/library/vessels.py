"""Hollow things: bowls, mugs, tumblers, tape rolls. Their walls are rings of convex pieces."""

from collections.abc import Mapping

import numpy as np

from torc.scenes.library.labels import Design, rgba, wrapped_label
from torc.scenes.library.meshes import revolve, sweep
from torc.scenes.library.parts import Parts, cylinder, polyline_capsules, ring_wall


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
