"""What one stirs, turns and cuts with: flat things that lie on the table along y."""

import numpy as np
from jaxtyping import Float

from tools.objects.labels import rgba
from tools.objects.meshes import box_mesh, facetted, loft, moved, prism_mesh, revolve, sweep
from tools.objects.parts import (
    Parts,
    box,
    cylinder,
    hull,
    polyline_capsules,
    prism,
    ring_points,
    rod,
    side_walls,
)
from tools.objects.tools import STEEL
from torc.objects.models import CollisionPiece, Quat, VisualMesh

Path = Float[np.ndarray, "k 3"]


def _material(color: str) -> Quat:
    return STEEL if color == "steel" else rgba(color)


def spoon(
    length_m: float,
    bowl_m: tuple[float, float, float],
    handle_m: tuple[float, float],
    arch_m: float,
    color: str,
) -> Parts:
    """A spoon that rests on its bowl, towards +y, and on the end of its handle.

    `bowl_m`: half breadth, half length and depth; `handle_m`: breadth and thickness; `arch_m`: how high the handle
    rises between its ends.
    """
    (a, b, depth), (breadth, thick) = bowl_m, handle_m
    foot, wall, shine = 0.5 * b, 0.0024, _material(color)
    axes, inner_axes = (a / b, 1.0), ((a - wall) / (b - wall), 1.0)
    rims = [ring_points(b - wall, depth, 40, inner_axes), ring_points(b, depth, 40, axes)]
    visuals = [
        revolve([(b, depth), (foot, 0), (0, 0)], axes=axes, rgba=shine),
        revolve([(0, wall), (foot, wall), (b - wall, depth)], axes=inner_axes, rgba=shine),
        facetted(loft(np.stack(rims), caps=False, rgba=shine)),
    ]
    outer = np.stack([ring_points(r, z, 12, axes) for r, z in ((b, depth), (foot, 0))])
    inner = np.stack([ring_points(r, z, 12, inner_axes) for r, z in ((b - wall, depth), (foot, wall))])
    path = _bridge((wall - b, depth - thick / 2), (b - length_m, thick / 2), arch_m)
    bar, links = _flat_bar(path, breadth, thick, shine)
    return Parts(
        [hull(np.concatenate([outer[1], inner[1]])), *side_walls(outer, inner), *links], [*visuals, bar]
    )


def _bridge(start: tuple[float, float], end: tuple[float, float], rise: float, count: int = 13) -> Path:
    """An arch in the y-z plane from one point (y, z) to another, steeper at its start."""
    f = np.linspace(0, 1, count)
    y, z = (a + (b - a) * f for a, b in zip(start, end))
    return np.stack([0 * f, y, z + rise * 4 * f * (1 - f) * (1.3 - 0.6 * f)], axis=1)


def _flat_bar(
    path: Path, breadth: float, thick: float, color: Quat
) -> tuple[VisualMesh, list[CollisionPiece]]:
    """A flat rounded bar along a path towards -y, narrower at its start: its surface and its pieces."""
    half = breadth / 2 * np.linspace(0.55, 1.0, len(path))
    t = -2 * np.pi * (np.arange(12) + 0.5) / 12  # clockwise about -y: to the right as seen from outside
    x, z = np.sign(np.cos(t)) * np.abs(np.cos(t)) ** 0.6, thick / 2 * np.sin(t)
    rings = path[:, None] + np.stack(
        [half[:, None] * x, 0 * half[:, None] * x, 0 * half[:, None] + z], axis=2
    )
    links = [hull(np.concatenate([rings[i], rings[i + 3]])) for i in range(0, len(path) - 1, 3)]
    return loft(rings, rgba=color), links


def turner(
    blade_m: tuple[float, float], handle_m: tuple[float, float], arch_m: float, color: str, grip: str
) -> Parts:
    """A slotted kitchen turner that rests on its blade, towards +y, and on the end of its handle.

    `blade_m`: length and breadth; `handle_m`: length and radius; `arch_m`: how high the handle rises.
    """
    (length, breadth), (reach, r), t = blade_m, handle_m, 0.003
    bars, slot = 4, 0.055 * breadth
    bar = (breadth - (bars - 1) * slot) / bars
    strips = [
        ((breadth, 0.16 * length, t), (0.0, 0.92 * length, t / 2)),
        ((breadth, 0.34 * length, t), (0.0, 0.17 * length, t / 2)),
    ]
    for k in range(bars):
        x = (k - (bars - 1) / 2) * (bar + slot)
        strips.append(((bar, 0.52 * length, t), (x, 0.59 * length, t / 2)))
    path = _bridge((0.012, t), (-reach, r), arch_m)
    neck, held = path[:6], path[5:]
    thickness = r * np.array([0.75, 0.95, 1.0, 1.0, 1.0, 1.0, 0.95, 0.8])
    visuals = [box_mesh(size, at, rgba=_material(color)) for size, at in strips]
    visuals.append(sweep(neck, 0.0035, sides=12, up=(1, 0, 0), rgba=_material(color)))
    visuals.append(sweep(held, thickness, sides=16, up=(1, 0, 0), rgba=rgba(grip)))
    pieces = [box(size, at, relative_density=3.0) for size, at in strips]
    pieces += polyline_capsules(neck, 0.0035)
    pieces += [rod(held[i], held[i + 1], float(np.mean(thickness[i : i + 2]))) for i in range(len(held) - 1)]
    return Parts(pieces, visuals)


def scissors(length_m: float, grip: str, spread_rad: float = 0.2) -> Parts:
    """Scissors that lie a little open, the blades towards +y."""
    s = length_m / 0.18
    thick, z, r = 0.0026 * s, 0.0048 * s, 0.0048 * s
    visuals: list[VisualMesh] = []
    pieces: list[CollisionPiece] = []
    for side, low in ((1, z - thick), (-1, z)):
        c, d = np.cos(side * spread_rad / 2), np.sin(side * spread_rad / 2)
        turn = np.array([[c, d], [-d, c]])
        outline = np.array([(0.0, 0.105), (-0.008, 0.0), (-0.009, -0.028), (0.006, -0.028), (0.006, 0.02)])
        blade = (outline * [-side, 1] * s @ turn).tolist()
        visuals.append(prism_mesh(blade, low, low + thick, rgba=STEEL))
        pieces.append(prism(blade, low, low + thick, relative_density=3.0))
        t = 2 * np.pi * np.arange(16) / 16
        loop = np.stack([side * 0.014 + 0.015 * np.cos(t), -0.050 + 0.026 * np.sin(t)], axis=1) * s @ turn
        ring = np.column_stack([loop, np.full(16, z)])
        visuals.append(_ring_tube(ring, r, rgba(grip)))
        pieces += polyline_capsules(np.concatenate([ring, ring[:1]])[::2], r)
    head = [(0.0, 0.0012), (0.0032 * s, 0.0012), (0.004 * s, 0.0), (0.0, 0.0)]
    screw = revolve(head, segments=16, rgba=(0.35, 0.35, 0.37, 1.0))
    visuals.append(moved(screw, position=(0, 0, z + thick)))
    pieces.append(cylinder(0.004 * s, z + thick, z + thick + 0.0012))
    return Parts(pieces, visuals)


def _ring_tube(path: Path, radius: float, color: Quat) -> VisualMesh:
    """A tube along a closed path in the plane of the table that runs counter-clockwise as seen from above."""
    t = 2 * np.pi * np.arange(12) / 12
    along = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    out = np.stack([along[:, 1], -along[:, 0], 0 * along[:, 0]], axis=1)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0])
    rings = path[:, None] + radius * (np.cos(t)[:, None] * out[:, None] + np.sin(t)[:, None] * up)
    return loft(np.concatenate([rings, rings[:1]]), caps=False, rgba=color)
