"""Small constructors of contact pieces, and the step that puts the model's origin where it belongs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tools.objects.meshes import moved
from torc.geometry.transforms import rotation_from_wxyz, wxyz_from_rotation
from torc.objects.models import CollisionPiece, Quat, Vec3, VisualMesh, pieces_bounds

LIFT_M = 0.0006
"""By how much a ring of wall pieces may end above the floor that it surrounds: only the floor touches the table then,
and there is one contact pair instead of twenty."""


@dataclass(frozen=True)
class Parts:
    """What a builder returns: pieces and visuals in one frame of its choice, z up and the front towards -x."""

    pieces: Sequence[CollisionPiece]
    visuals: Sequence[VisualMesh]


def centered(parts: Parts) -> tuple[tuple[CollisionPiece, ...], tuple[VisualMesh, ...], Vec3]:
    """Pieces and visuals about the centre of the pieces' bounding box, and the box's edge lengths."""
    lower, upper = pieces_bounds(list(parts.pieces))
    shift = -(lower + upper) / 2
    pieces = tuple(replace(p, position=vec3(np.array(p.position) + shift)) for p in parts.pieces)
    visuals = tuple(replace(v, vertices=v.vertices + shift) for v in parts.visuals)
    return pieces, visuals, vec3(upper - lower)


def turned(parts: Parts, R: Float[np.ndarray, "3 3"]) -> Parts:
    """The parts rotated about their origin."""
    pieces = [
        replace(p, position=vec3(R @ np.array(p.position)), wxyz=_wxyz(R @ rotation_from_wxyz(p.wxyz)))
        for p in parts.pieces
    ]
    return Parts(pieces, [moved(v, R) for v in parts.visuals])


def vec3(values: np.ndarray | Sequence[float]) -> Vec3:
    """Three plain floats."""
    x, y, z = (float(v) for v in values)
    return x, y, z


def along(direction: np.ndarray | Sequence[float]) -> Quat:
    """Rotation that turns z to a direction."""
    z = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    helper = np.array([1.0, 0, 0]) if abs(z[0]) < 0.9 else np.array([0, 1.0, 0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return _wxyz(np.stack([x, np.cross(z, x), z], axis=1))


def _wxyz(R: np.ndarray) -> Quat:
    w, i, j, k = (float(v) for v in wxyz_from_rotation(R))
    return w, i, j, k


def yaw(angle: float) -> Quat:
    """Rotation about z, radians."""
    return float(np.cos(angle / 2)), 0.0, 0.0, float(np.sin(angle / 2))


def box(size: Sequence[float], position: Sequence[float] = (0, 0, 0), **options: object) -> CollisionPiece:
    """A box of full edge lengths `size`."""
    half = tuple(0.5 * float(s) for s in size)
    return CollisionPiece("box", half, vec3(position), **options)  # type: ignore[arg-type]


def cylinder(radius: float, z0: float, z1: float, **options: object) -> CollisionPiece:
    """An upright cylinder about the z axis from z0 to z1."""
    return CollisionPiece("cylinder", (radius, (z1 - z0) / 2), (0.0, 0.0, (z0 + z1) / 2), **options)  # type: ignore[arg-type]


def rod(
    start: Sequence[float] | np.ndarray,
    end: Sequence[float] | np.ndarray,
    radius: float,
    kind: str = "cylinder",
    **options: object,
) -> CollisionPiece:
    """A cylinder, or a capsule whose caps' centres are `start` and `end`, between two points."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    size = (radius, float(np.linalg.norm(b - a)) / 2)
    return CollisionPiece(kind, size, vec3((a + b) / 2), along(b - a), **options)  # type: ignore[arg-type]


def hull(vertices: np.ndarray | Sequence[Sequence[float]], **options: object) -> CollisionPiece:
    """The convex hull of points."""
    return CollisionPiece("mesh", vertices=np.array(vertices, dtype=float), **options)  # type: ignore[arg-type]


def ring_points(
    radius: float, z: float, segments: int = 16, axes: tuple[float, float] = (1, 1)
) -> np.ndarray:
    """Points on a horizontal circle (or ellipse: radius times axes), shape (segments, 3)."""
    t = 2 * np.pi * np.arange(segments) / segments
    return np.stack(
        [axes[0] * radius * np.cos(t), axes[1] * radius * np.sin(t), np.full(segments, z)], axis=1
    )


def frustum(
    r0: float, z0: float, r1: float, z1: float, segments: int = 16, **options: object
) -> CollisionPiece:
    """A truncated cone about z as a convex mesh."""
    rings = [ring_points(r0, z0, segments), ring_points(r1, z1, segments)]
    return hull(np.concatenate(rings), **options)


def ring_wall(
    outer: tuple[float, float], wall_m: float, z0: float, z1: float, segments: int = 12
) -> list[CollisionPiece]:
    """A hollow wall of convex segments about z.

    `outer` = outer radius at z0 and at z1. The polygon's corners lie a little outside the true circle and the middles
    of its sides a little inside it, so that the error is halved. Straight walls are boxes, tapered ones meshes.
    """
    half = np.pi / segments
    grow = 2.0 / (1.0 + np.cos(half))
    mid_angles = 2 * np.pi * np.arange(segments) / segments
    if outer[0] == outer[1]:
        apothem = outer[0] * grow * np.cos(half)
        size = (wall_m, 2 * apothem * np.tan(half), z1 - z0)
        r, z = apothem - wall_m / 2, (z0 + z1) / 2
        return [box(size, (r * np.cos(a), r * np.sin(a), z), wxyz=yaw(a)) for a in mid_angles]
    section = [(r, z) for r_outer, z in zip(outer, (z0, z1)) for r in (r_outer, r_outer - wall_m)]
    return ring_hulls(section, segments)


def ring_hulls(
    section: Sequence[tuple[float, float]], segments: int = 12, axes: tuple[float, float] = (1, 1)
) -> list[CollisionPiece]:
    """A ring about z with a convex cross-section, given by its (r, z) corners, as convex segments.

    The polygon's corners lie a little outside the true circle and the middles of its sides a little inside it. `axes`
    stretches x and y.
    """
    half = np.pi / segments
    grow = 2.0 / (1.0 + np.cos(half))
    pieces = []
    for a in 2 * np.pi * np.arange(segments) / segments:
        corners = [
            (axes[0] * (r * grow * np.cos(b)), axes[1] * (r * grow * np.sin(b)), z)
            for r, z in section
            for b in (a - half, a + half)
        ]
        pieces.append(hull(corners))
    return pieces


def side_walls(outer: Float[np.ndarray, "2 s 3"], inner: Float[np.ndarray, "2 s 3"]) -> list[CollisionPiece]:
    """The walls of an open box: one convex piece per side of its outline, a little above its base.

    Rings of corners, the upper one first.
    """
    outer = np.maximum(outer, [-np.inf, -np.inf, outer[1, 0, 2] + LIFT_M])
    following = [np.roll(ring, -1, axis=0) for ring in (*outer, *inner)]
    corners = np.stack([*outer, *inner, *following], axis=1)
    return [hull(side) for side in corners]


def prism(outline: Sequence[tuple[float, float]], z0: float, z1: float, **options: object) -> CollisionPiece:
    """A convex outline in the plane of the table, from z0 up to z1."""
    xy = np.array(outline, dtype=float)
    ends = [np.column_stack([xy, np.full(len(xy), z)]) for z in (z0, z1)]
    return hull(np.concatenate(ends), **options)


def polyline_capsules(
    points: Float[np.ndarray, "n 3"], radii: Sequence[float] | float, **options: object
) -> list[CollisionPiece]:
    """Capsules along a polyline; the radius of each link is the mean of its ends'."""
    r = np.broadcast_to(np.asarray(radii, dtype=float), len(points))
    return [
        rod(points[i], points[i + 1], float(r[i] + r[i + 1]) / 2, "capsule", **options)
        for i in range(len(points) - 1)
    ]
