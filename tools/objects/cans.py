"""Upright round packages: food cans, drink cans, spray cans, jars, pots and cups with lids."""

from collections.abc import Mapping

import numpy as np

from tools.objects.labels import Design, rgba, wrapped_label
from tools.objects.meshes import arc, revolve
from tools.objects.parts import Parts, cylinder, frustum

METAL = (0.78, 0.79, 0.8, 1.0)


def food_can(radius_m: float, height_m: float, design: Mapping[str, str]) -> Parts:
    """A tin: a paper label between two metal rims, sunk lids."""
    r, h = radius_m, height_m
    rim = 0.0025
    label = wrapped_label(2 * np.pi * r, h - 2 * rim, Design(**design))
    wall = revolve([(r - 0.0006, h - rim), (r - 0.0006, rim)], texture=label)
    lid = revolve(
        [
            (0, h - 0.0015),
            (r - 0.003, h - 0.0015),
            (r - 0.002, h),
            (r, h),
            (r, h - rim),
            (r - 0.0006, h - rim),
        ],
        rgba=METAL,
    )
    base = revolve([(r - 0.0006, rim), (r, rim), (r, 0), (0, 0)], rgba=METAL)
    return Parts([cylinder(r, 0, h)], [wall, lid, base])


def drink_can(radius_m: float, height_m: float, design: Mapping[str, str]) -> Parts:
    """A drink can: printed wall, necked at both ends, with a ring pull."""
    r, h = radius_m, height_m
    neck, foot = 0.012, 0.007
    label = wrapped_label(2 * np.pi * r, h - neck - foot, Design(**design))
    wall = revolve([(r, h - neck), (r, foot)], texture=label)
    top = revolve(
        [(0, h - 0.002), (r - 0.008, h - 0.002), (r - 0.007, h), (r - 0.005, h), (r, h - neck)], rgba=METAL
    )
    pull = revolve(
        [(0, h - 0.0006), (0.009, h - 0.0006), (0.009, h - 0.002)], axes=(0.6, 1.0), rgba=(0.6, 0.61, 0.62, 1)
    )
    base = revolve([(r, foot), (r - 0.005, 0), (0, 0)], rgba=METAL)
    pieces = [
        cylinder(r, foot, h - neck),
        frustum(r, h - neck, r - 0.005, h),
        frustum(r - 0.005, 0, r, foot),
    ]
    return Parts(pieces, [wall, top, pull, base])


def spray_can(radius_m: float, height_m: float, design: Mapping[str, str], cap: str) -> Parts:
    """A tall spray can with a domed shoulder and a cap."""
    r, h = radius_m, height_m
    shoulder, cap_height, cap_radius = 0.012, 0.035, r - 0.006
    z = h - cap_height - shoulder
    label = wrapped_label(2 * np.pi * r, z, Design(**design))
    wall = revolve([(r, z), (r, 0)], texture=label)
    dome = revolve([(cap_radius, z + shoulder), (r, z)], rgba=METAL)
    lid = revolve(
        [(0, h), *arc((cap_radius - 0.002, h - 0.002), 0.002, np.pi / 2, 0), (cap_radius, z + shoulder)],
        rgba=rgba(cap),
    )
    base = revolve([(r, 0), (0, 0)], rgba=METAL)
    pieces = [
        cylinder(r, 0, z),
        frustum(r, z, cap_radius, z + shoulder),
        cylinder(cap_radius, z + shoulder, h),
    ]
    return Parts(pieces, [wall, dome, lid, base])


def jar(radius_m: float, height_m: float, design: Mapping[str, str], content: str, lid: str) -> Parts:
    """A glass jar (opaque: the colour of its content) with a label and a screw lid."""
    r, h = radius_m, height_m
    lid_height, lid_radius, shoulder = min(0.018, 0.25 * h), r - 0.003, 0.006
    z = h - lid_height - shoulder
    low, high = 0.12 * z, 0.85 * z
    label = wrapped_label(2 * np.pi * r, high - low, Design(**design))
    glass = rgba(content)
    visuals = [
        revolve([(r, high), (r, low)], texture=label),
        revolve([(lid_radius, z + shoulder), (r, z), (r, high)], rgba=glass),
        revolve([(r, low), (r, 0.003), (r - 0.003, 0), (0, 0)], rgba=glass),
        revolve(
            [(0, h), (lid_radius - 0.001, h), (lid_radius, h - 0.001), (lid_radius, z + shoulder)],
            rgba=rgba(lid),
        ),
    ]
    pieces = [
        cylinder(r, 0, z),
        frustum(r, z, lid_radius, z + shoulder),
        cylinder(lid_radius, z + shoulder, h),
    ]
    return Parts(pieces, visuals)


def lidded_cup(
    radii_m: tuple[float, float],
    height_m: float,
    design: Mapping[str, str],
    lid: tuple[float, float, str],
    color: str,
    label: tuple[float, float] = (0.0, 1.0),
) -> Parts:
    """A cup or pot that widens upwards, closed by a lid; radii at the foot and under the lid.

    `lid`: how far it sticks out, its height, its colour. The label spans part of the wall's height.
    """
    (r0, r1), h = radii_m, height_m
    out, lid_height, lid_color = lid
    z = h - lid_height
    (low, high), slope = (label[0] * z, label[1] * z), (r1 - r0) / z
    around = wrapped_label(np.pi * (r0 + r1), high - low, Design(**design))
    visuals = [revolve([(r0 + slope * high, high), (r0 + slope * low, low)], texture=around)]
    if high < z:
        visuals.append(revolve([(r1, z), (r0 + slope * high, high)], rgba=rgba(color)))
    foot = [(r0 + slope * low, low)] if low > 0 else []
    visuals.append(revolve([*foot, (r0, 0), (0, 0)], rgba=rgba(color)))
    rim, top, bead = r1 + out, r1 + out - 0.4 * lid_height, min(0.004, lid_height)
    sunk = h - 0.15 * (lid_height - bead)
    outline = [(0, sunk), (top - 0.003, sunk), (top - 0.002, h), (top, h), (rim, z + bead), (rim, z), (r1, z)]
    visuals.append(revolve(outline, rgba=rgba(lid_color)))
    pieces = [frustum(r0, 0, r1, z), cylinder(rim, z, z + bead)]
    if lid_height > bead:
        pieces.append(frustum(rim, z + bead, top, h))
    return Parts(pieces, visuals)
