"""Visual surfaces: revolved, lofted, swept and box meshes with normals and texture coordinates.

All triangles are counter-clockwise from outside. On every textured surface u runs to the right and v down, as seen
from outside, so that text reads the right way round.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from torc.objects.models import Quat, VisualMesh

Texture = UInt8[np.ndarray, "h w 3"] | None
WHITE: Quat = (1.0, 1.0, 1.0, 1.0)
SHARP_RAD = 0.6
"""Corners of a profile sharper than this get an edge, others are shaded smoothly."""


def revolve(
    profile: Sequence[tuple[float, float]],
    *,
    segments: int = 40,
    axes: tuple[float, float] = (1.0, 1.0),
    texture: Texture = None,
    rgba: Quat = WHITE,
) -> VisualMesh:
    """Surface of revolution about z.

    `profile`: (r, z) points in the order in which the outside lies to the left of the way: from the top down on an
    outer wall, from the centre outwards on a lid, upwards on an inner wall. `axes` stretches x and y. u = angle / 2 pi
    from +x on, so the middle of the texture faces -x; v = way along the profile.
    """
    p = np.array(profile, dtype=float)
    steps = np.diff(p, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    flat = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / lengths[:, None]
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    way /= way[-1]
    angles = 2 * np.pi * np.arange(segments + 1) / segments
    c, s = np.cos(angles), np.sin(angles)
    # Every segment of the profile has its own two rings, upper and lower: its ends may be sharp edges.
    ends = np.stack([np.arange(len(steps)), np.arange(len(steps)) + 1], axis=1).ravel()
    n = np.concatenate([[_smooth(flat, i, i - 1), _smooth(flat, i, i + 1)] for i in range(len(steps))])
    r, nr = p[ends, :1], n[:, :1]
    rings = np.ones((len(ends), segments + 1))
    vertices = np.stack([axes[0] * r * c, axes[1] * r * s, p[ends, 1:] * rings], axis=2)
    normals = np.stack([nr * c / axes[0], nr * s / axes[1], n[:, 1:] * rings], axis=2)
    uv = np.stack([angles / (2 * np.pi) * rings, way[ends, None] * rings], axis=2)
    pole = p[:, 0] < 1e-9
    faces = [
        2 * i * (segments + 1) + _strip(segments, bool(pole[i]), bool(pole[i + 1])) for i in range(len(steps))
    ]
    ring = [vertices.reshape(-1, 3)], [normals.reshape(-1, 3)], [uv.reshape(-1, 2)]
    return _mesh(*ring, faces, texture, rgba)


def _smooth(flat: np.ndarray, i: int, neighbour: int) -> np.ndarray:
    """Normal of segment i at its joint with a neighbour: shared if the corner is smooth."""
    if not 0 <= neighbour < len(flat) or flat[i] @ flat[neighbour] < np.cos(SHARP_RAD):
        return flat[i]
    return flat[i] + flat[neighbour]


@cache
def _strip(segments: int, upper_pole: bool = False, lower_pole: bool = False) -> np.ndarray:
    """Triangles between two rings of segments + 1 vertices; none of zero area at a pole."""
    j = np.arange(segments)
    a, b = j, j + segments + 1
    first = np.stack([a, b, a + 1], axis=1)
    second = np.stack([a + 1, b, b + 1], axis=1)
    return np.concatenate([x for x, drop in ((first, upper_pole), (second, lower_pole)) if not drop])


def _mesh(
    vertices: list[np.ndarray],
    normals: list[np.ndarray],
    uv: list[np.ndarray],
    faces: list[np.ndarray],
    texture: Texture,
    rgba: Quat,
) -> VisualMesh:
    n = np.concatenate(normals)
    return VisualMesh(
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces).astype(np.int32),
        uv=np.concatenate(uv) if texture is not None else None,
        texture=texture,
        rgba=rgba,
        normals=n / np.linalg.norm(n, axis=1, keepdims=True),
    )


BOX_FACES = ("front", "back", "left", "right", "top", "bottom")
_BOX_AXES = {  # outward normal, right, down, as seen from outside
    "front": ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "back": ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "left": ((0, 1, 0), (-1, 0, 0), (0, 0, -1)),
    "right": ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    "top": ((0, 0, 1), (0, -1, 0), (-1, 0, 0)),
    "bottom": ((0, 0, -1), (0, 1, 0), (-1, 0, 0)),
}


def box_mesh(
    size: Sequence[float],
    position: Sequence[float] = (0, 0, 0),
    *,
    cells: dict[str, tuple[float, float, float, float]] | None = None,
    texture: Texture = None,
    rgba: Quat = WHITE,
) -> VisualMesh:
    """A box of full edge lengths `size`; `cells`: (u0, v0, u1, v1) of the texture for each of BOX_FACES."""
    half, center = np.array(size, dtype=float) / 2, np.array(position, dtype=float)
    vertices, normals, uv, faces = [], [], [], []
    for i, name in enumerate(BOX_FACES):
        normal, right, down = (np.array(a, dtype=float) for a in _BOX_AXES[name])
        u0, v0, u1, v1 = cells[name] if cells else (0.0, 0.0, 1.0, 1.0)
        corners = [normal - right - down, normal + right - down, normal + right + down, normal - right + down]
        vertices.append(center + half * np.array(corners))
        normals.append(np.tile(normal, (4, 1)))
        uv.append(np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)]))
        faces.append(4 * i + np.array([(0, 2, 1), (0, 3, 2)]))
    return _mesh(vertices, normals, uv, faces, texture, rgba)


def loft(
    rings: Float[np.ndarray, "k s 3"], *, texture: Texture = None, rgba: Quat = WHITE, caps: bool = True
) -> VisualMesh:
    """Surface through closed rings of points.

    Seen from outside with the first ring at the top, the points of a ring run to the right. Smooth normals; the ends
    are closed by flat fans if `caps`. u along the ring, v from the first ring to the last.
    """
    rings = np.concatenate([rings, rings[:, :1]], axis=1)
    k, s = rings.shape[0], rings.shape[1] - 1
    d_down = np.gradient(rings, axis=0)
    closed = np.concatenate([rings[:, -2:-1], rings, rings[:, 1:2]], axis=1)
    d_right = closed[:, 2:] - closed[:, :-2]
    normals = np.cross(d_down, d_right).reshape(-1, 3)
    u, v = np.meshgrid(np.linspace(0, 1, s + 1), np.linspace(0, 1, k))
    grid = [_strip(s) + i * (s + 1) for i in range(k - 1)]
    parts = ([rings.reshape(-1, 3)], [normals], [np.stack([u.ravel(), v.ravel()], axis=1)], grid)
    if caps:
        for ring, flip in ((rings[0, :-1], False), (rings[-1, :-1], True)):
            _add_fan(parts, ring, flip)
    return _mesh(*parts, texture, rgba)


def _add_fan(parts: tuple[list[Any], list[Any], list[Any], list[Any]], ring: np.ndarray, flip: bool) -> None:
    """Close an end with a flat fan about the ring's centre."""
    offset, n = sum(len(v) for v in parts[0]), len(ring)
    center = ring.mean(axis=0)
    j = np.arange(n)
    fan = np.stack([np.full(n, n), j, (j + 1) % n], axis=1)
    normal = np.cross(ring - center, np.roll(ring, -1, axis=0) - center).sum(axis=0)
    if flip:
        fan, normal = fan[:, ::-1], -normal
    parts[0].append(np.vstack([ring, center]))
    parts[1].append(np.tile(normal, (n + 1, 1)))
    parts[2].append(np.tile([0.5, 1.0 if flip else 0.0], (n + 1, 1)))
    parts[3].append(fan + offset)


def sweep(
    path: Float[np.ndarray, "k 3"],
    radii: Sequence[float] | np.ndarray | float,
    *,
    sides: int = 16,
    up: Sequence[float] = (0, 0, 1),
    texture: Texture = None,
    rgba: Quat = WHITE,
) -> VisualMesh:
    """A round tube along a path that is nowhere parallel to `up`."""
    r = np.broadcast_to(np.asarray(radii, dtype=float), len(path))
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(np.asarray(up, dtype=float), tangent)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    over = np.cross(tangent, side)
    t = 2 * np.pi * np.arange(sides) / sides
    # Clockwise about the tangent: to the right as seen from outside when the path goes down.
    ring = np.cos(t)[None, :, None] * side[:, None] - np.sin(t)[None, :, None] * over[:, None]
    return loft(path[:, None] + r[:, None, None] * ring, texture=texture, rgba=rgba)


def prism_mesh(
    outline: Sequence[tuple[float, float]], z0: float, z1: float, *, rgba: Quat = WHITE
) -> VisualMesh:
    """An outline in the plane of the table, star-shaped about its mean, from z0 up to z1."""
    xy = np.array(outline, dtype=float)
    after = np.roll(xy, -1, axis=0)
    if (xy[:, 0] * after[:, 1] - xy[:, 1] * after[:, 0]).sum() < 0:  # clockwise
        xy = xy[::-1]
    return facetted(loft(np.stack([np.column_stack([xy, np.full(len(xy), z)]) for z in (z1, z0)]), rgba=rgba))


def ellipsoid_mesh(half_axes: Sequence[float], *, rgba: Quat = WHITE, texture: Texture = None) -> VisualMesh:
    """An ellipsoid about the origin."""
    a, b, c = half_axes
    profile = [(a * r, c * z) for r, z in arc((0.0, 0.0), 1.0, np.pi / 2, -np.pi / 2, 16)]
    profile[0], profile[-1] = (0.0, c), (0.0, -c)
    return revolve(profile, segments=28, axes=(1.0, b / a), rgba=rgba, texture=texture)


def disc(ring: Float[np.ndarray, "s 3"], *, rgba: Quat = WHITE) -> VisualMesh:
    """A flat surface within a ring that runs counter-clockwise as seen from the side that it faces."""
    parts: tuple[list[Any], list[Any], list[Any], list[Any]] = ([], [], [], [])
    _add_fan(parts, ring, flip=False)
    return _mesh(*parts, None, rgba)


def facetted(mesh: VisualMesh) -> VisualMesh:
    """The same surface with flat-shaded triangles."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(
        mesh,
        vertices=corners.reshape(-1, 3),
        faces=np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3),
        uv=None if mesh.uv is None else mesh.uv[mesh.faces].reshape(-1, 2),
        normals=np.repeat(normals, 3, axis=0),
    )


def moved(
    mesh: VisualMesh, R: np.ndarray | None = None, position: Sequence[float] | np.ndarray = (0, 0, 0)
) -> VisualMesh:
    """The mesh rotated, then shifted."""
    R = np.eye(3) if R is None else R
    normals = None if mesh.normals is None else mesh.normals @ R.T
    return replace(mesh, vertices=mesh.vertices @ R.T + np.asarray(position, dtype=float), normals=normals)


def arc(
    center: tuple[float, float], radius: float, start_rad: float, end_rad: float, steps: int = 6
) -> list[tuple[float, float]]:
    """Profile points on a circle in the (r, z) plane; angle 0 points along +r, pi / 2 along +z."""
    t = np.linspace(start_rad, end_rad, steps + 1)
    return [
        (max(0.0, center[0] + radius * float(np.cos(a))), center[1] + radius * float(np.sin(a))) for a in t
    ]
