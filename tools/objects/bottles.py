"""Bottles, round and oval, and tubes that lie."""

from collections.abc import Mapping

import numpy as np

from tools.objects.labels import Design, lying_label, rgba, wrapped_label
from tools.objects.meshes import loft, moved, revolve
from tools.objects.parts import Parts, cylinder, frustum, hull, ring_points, rod
from torc.geometry.transforms import rotation_about

Look = Mapping[str, str]
LYING = rotation_about((1, 0, 0), -np.pi / 2) @ rotation_about((0, 0, 1), np.pi / 2)
"""Lays an upright thing down: its top to +y, its front up."""


def round_bottle(
    radius_m: float,
    height_m: float,
    shoulder_m: float,
    cap: tuple[float, float, str],
    color: str,
    design: Look,
    label: tuple[float, float] = (0.2, 0.8),
) -> Parts:
    """A round bottle: body, conical shoulder, cap (radius, height, colour); the label spans part of the body."""
    r, h = radius_m, height_m
    cap_radius, cap_height, cap_color = cap
    top = h - cap_height
    body = top - shoulder_m
    low, high = label[0] * body, label[1] * body
    paper = wrapped_label(2 * np.pi * r, high - low, Design(**design))
    visuals = [
        revolve([(r, high), (r, low)], texture=paper),
        revolve([(cap_radius, top), (r, body), (r, high)], rgba=rgba(color)),
        revolve([(r, low), (r, 0.002), (r - 0.002, 0), (0, 0)], rgba=rgba(color)),
        revolve(
            [(0, h), (cap_radius - 0.001, h), (cap_radius, h - 0.001), (cap_radius, top)],
            rgba=rgba(cap_color),
        ),
    ]
    pieces = [cylinder(r, 0, body), frustum(r, body, cap_radius, top), cylinder(cap_radius, top, h)]
    return Parts(pieces, visuals)


def oval_bottle(
    size_m: tuple[float, float, float],
    waist: float,
    shoulder_m: float,
    cap: tuple[float, float, float, str],
    color: str,
    design: Look,
) -> Parts:
    """An oval bottle: depth, width, height; the foot is `waist` times as wide as the shoulder.

    `cap`: its radius below and above, its height, its colour.
    """
    depth, width, h = size_m
    axes = (depth / width, 1.0)
    r = width / 2
    cap_low, cap_high, cap_height, cap_color = cap
    top, foot = h - cap_height, waist * width / 2
    body = top - shoulder_m
    low, high = 0.12 * body, 0.92 * body

    def radius(z: float) -> float:
        return foot + (r - foot) * z / body

    paper = wrapped_label(np.pi * (depth + width) / 2, high - low, Design(**design))
    skin = rgba(color)
    visuals = [
        revolve([(radius(high), high), (radius(low), low)], axes=axes, texture=paper),
        revolve([(radius(low), low), (foot, 0), (0, 0)], axes=axes, rgba=skin),
        revolve([(r, body), (radius(high), high)], axes=axes, rgba=skin),
        loft(np.stack([_round_ring(cap_low, top), _round_ring(r, body, axes)]), rgba=skin),
        revolve([(0, h), (cap_high, h), (cap_low, top), (0, top)], rgba=rgba(cap_color)),
    ]
    below = hull(np.concatenate([ring_points(foot, 0, 20, axes), ring_points(r, body, 20, axes)]))
    shoulder = hull(np.concatenate([ring_points(r, body, 20, axes), ring_points(cap_low, top, 20)]))
    lid = cylinder(cap_low, top, h) if cap_low == cap_high else frustum(cap_low, top, cap_high, h)
    return Parts([below, shoulder, lid], visuals)


def _round_ring(radius: float, z: float, axes: tuple[float, float] = (1, 1)) -> np.ndarray:
    return ring_points(radius, z, 40, axes)


def toothpaste_tube(length_m: float, radius_m: float, tail_m: float, cap: str, design: Look) -> Parts:
    """A tube that lies: round at its cap (+y), flat at its tail (-y, `tail_m` wide)."""
    r, cap_length, cap_radius = radius_m, 0.022, 0.7 * radius_m
    start, end = length_m / 2 - cap_length, -length_m / 2
    t = 2 * np.pi * np.arange(32) / 32
    around = np.stack([-np.sin(t), -np.cos(t)], axis=1)  # from below, to the right as seen from outside
    rings = []
    for f in np.linspace(0, 1, 9):
        half_x, half_z = (1 - f) * r + f * tail_m / 2, (1 - f) * r + f * 0.0015
        x, z = half_x * around[:, 0], half_z * (around[:, 1] + 1) - r
        rings.append(np.stack([x, np.full(32, start + f * (end - start)), z], axis=1))
    shape = np.stack(rings)
    print_ = lying_label(length_m - cap_length, 2 * np.pi * r, Design(**design))
    cap_mesh = revolve(
        [(0, cap_length), (0.9 * cap_radius, cap_length), (cap_radius, 0), (0, 0)], rgba=rgba(cap)
    )
    visuals = [
        loft(shape, texture=print_),
        moved(cap_mesh, LYING, (0, start, 0)),
    ]
    pieces = [
        hull(np.concatenate([shape[0], shape[-1]])),
        rod((0, start, 0), (0, start + cap_length, 0), 0.95 * cap_radius),
    ]
    return Parts(pieces, visuals)


def marker(length_m: float, radius_m: float, color: str, barrel: str, text: str) -> Parts:
    """A marker pen that lies, its cap towards +y."""
    r, cap = radius_m, 0.38 * length_m
    split = length_m / 2 - cap
    look = Design(barrel, text, barrel, color)
    print_ = lying_label(split + length_m / 2, 2 * np.pi * r, look)
    visuals = [
        revolve(
            [(r, split), (r, -length_m / 2)],
            segments=24,
            texture=print_,
        ),
        revolve([(r, -length_m / 2), (0, -length_m / 2)], segments=24, rgba=rgba(color)),
        revolve(
            [(0, length_m / 2), (r - 0.001, length_m / 2), (r, length_m / 2 - 0.002), (r, split)],
            segments=24,
            rgba=rgba(color),
        ),
    ]
    ends = (0, -length_m / 2, 0), (0, length_m / 2, 0)
    return Parts([rod(*ends, r)], [moved(v, LYING) for v in visuals])
