"""Surfaces as a mesh file has them, and their cleaning. numpy only."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, UInt8

from torc.scenes.importing.slivers import flat_faces
from torc.scenes.models import Quat

GREY: Quat = (0.72, 0.72, 0.74, 1.0)
"""Of meshes without colours."""
_SHARP_COS = float(np.cos(np.deg2rad(40.0)))
_MAX_FAN = 64


@dataclass(frozen=True, eq=False)
class Surface:
    """One surface of one material.

    Attributes:
        vertices, faces: the triangles, z up, metres.
        uv: texture coordinates per vertex, v down, or None.
        texture: its picture, or None.
        rgba: colour; multiplies the texture.
        colours: per vertex, or None; they take the place of rgba.
    """

    vertices: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    uv: Float[np.ndarray, "n 2"] | None = None
    texture: UInt8[np.ndarray, "h w 3"] | None = None
    rgba: Quat = GREY
    colours: UInt8[np.ndarray, "n 3"] | None = None


def coloured(surface: Surface, colours: UInt8[np.ndarray, "n 3"]) -> Surface:
    """The surface with a colour per vertex; where they are all the same, it is the surface's."""
    if len(colours) and (colours == colours[0]).all():
        r, g, b = (float(c) / 255 for c in colours[0])
        return replace(surface, rgba=(r, g, b, 1.0), colours=None)
    return replace(surface, colours=colours)


def textured(surface: Surface, uv: Float[np.ndarray, "n 2"], texture: UInt8[np.ndarray, "h w 3"]) -> Surface:
    """The surface with a texture; coordinates (v down) that are no numbers or absurd are made harmless."""
    finite = np.where(np.isfinite(uv).all(axis=1)[:, None], uv, 0.0)
    return replace(surface, uv=np.clip(finite, -1e3, 1e3), texture=texture)


def with_sound_faces(surface: Surface) -> tuple[Surface, int]:
    """The surface without faces that use corners which are not there or not finite, or are there twice, and without
    unused vertices. Also how many faces were dropped."""
    faces = surface.faces[((surface.faces >= 0) & (surface.faces < len(surface.vertices))).all(axis=1)]
    faces = faces[np.isfinite(surface.vertices[faces]).all(axis=(1, 2))]
    # Turned copies of a face start with the same corner after this; mirrored ones (a sheet with two sides) stay.
    turn = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3 if len(faces) else np.zeros((0, 3), int)
    _, first = np.unique(np.take_along_axis(faces, turn, axis=1), axis=0, return_index=True)
    faces = faces[np.sort(first)]
    return compact(replace(surface, faces=faces)), len(surface.faces) - len(faces)


def with_area(surface: Surface) -> Surface:
    """The surface without faces that have no area, and without unused vertices."""
    return compact(replace(surface, faces=surface.faces[~flat_faces(surface.vertices, surface.faces)]))


def compact(surface: Surface) -> Surface:
    """The surface without vertices that no face uses."""
    used, inverse = np.unique(surface.faces, return_inverse=True)
    return Surface(
        surface.vertices[used],
        inverse.reshape(-1, 3).astype(np.int64),
        None if surface.uv is None else surface.uv[used],
        surface.texture,
        surface.rgba,
        None if surface.colours is None else surface.colours[used],
    )


def welded(
    vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]
) -> tuple[Float[np.ndarray, "k 3"], Int[np.ndarray, "l 3"]]:
    """One closed net where corners coincide (to a millionth of the size); every triangle once, none degenerate."""
    step = 1e-6 * max(float(np.ptp(vertices, axis=0).max()), 1e-9)
    keys = np.round((vertices - vertices.min(axis=0)) / step).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    net = inverse.reshape(-1)[faces]
    net = net[(net[:, 0] != net[:, 1]) & (net[:, 1] != net[:, 2]) & (net[:, 2] != net[:, 0])]
    _, once = np.unique(np.sort(net, axis=1), axis=0, return_index=True)
    net = net[np.sort(once)]
    used, renumbered = np.unique(net, return_inverse=True)
    return vertices[first][used], renumbered.reshape(-1, 3).astype(np.int64)


def with_normals(surface: Surface) -> tuple[Surface, Float[np.ndarray, "n 3"]]:
    """The surface with vertices split at sharp edges (40 degrees), and a unit normal per vertex, smooth elsewhere."""
    faces = surface.faces
    corners = surface.vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # length: twice the area
    unit = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    step = 1e-6 * max(float(np.ptp(surface.vertices, axis=0).max()), 1e-9)
    keys = np.round(corners.reshape(-1, 3) / step).astype(np.int64)
    _, place = np.unique(keys, axis=0, return_inverse=True)
    normals = _smooth(place.reshape(-1), np.repeat(flat, 3, axis=0), np.repeat(unit, 3, axis=0))
    # Corners of the same vertex with the same normal become one vertex again.
    rows = np.concatenate([faces.reshape(-1, 1), np.round(normals * 1e4)], axis=1).astype(np.int64)
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    source = faces.reshape(-1)[first]
    split = Surface(
        surface.vertices[source],
        inverse.reshape(-1, 3).astype(np.int64),
        None if surface.uv is None else surface.uv[source],
        surface.texture,
        surface.rgba,
        None if surface.colours is None else surface.colours[source],
    )
    return split, normals[first]


def _smooth(place: np.ndarray, flat: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Per corner the mean, by area, of the normals around its place that differ little from its own."""
    order = np.argsort(place, kind="stable")
    starts = np.searchsorted(place[order], np.arange(place.max() + 2))
    rank = np.empty(len(place), np.int64)
    rank[order] = np.arange(len(place)) - starts[place[order]]
    size = np.diff(starts)[place]
    total = np.zeros_like(flat)
    # Neighbour k places further round the same point; a fan of thousands of triangles is looked at in part.
    for k in range(min(int(size.max()), _MAX_FAN)):
        active = np.flatnonzero(k < size)
        other = order[starts[place[active]] + (rank[active] + k) % size[active]]
        near = (unit[active] * unit[other]).sum(axis=1) > _SHARP_COS
        total[active[near]] += flat[other[near]]
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))
