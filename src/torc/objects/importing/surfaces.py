"""Surfaces as a mesh file has them, and their cleaning."""

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from jaxtyping import Float, Int, UInt8

from torc.objects.models import Quat, VisualMesh

GREY: Quat = (0.72, 0.72, 0.74, 1.0)
"""Of meshes without colours."""
_SHARP_RAD = float(np.deg2rad(40.0))
_WELD_DIGITS = 6
"""Corners that are the same to a micrometre are one."""
_FLAT = 1e-6
"""Area against the square of the longest edge: above the rounding of files in single precision, and of a thing of 0.3 m
less than a micrometre."""


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

    def only(self, faces: Int[np.ndarray, "k 3"]) -> "Surface":
        """The surface with these faces, without vertices that they do not use."""
        used, inverse = np.unique(faces, return_inverse=True)
        return self.at(used, inverse.reshape(-1, 3))

    def at(self, rows: Int[np.ndarray, "k"], faces: Int[np.ndarray, "l 3"]) -> "Surface":
        """A surface of some of the vertices; the faces count those."""
        return replace(
            self,
            vertices=self.vertices[rows],
            faces=faces,
            uv=None if self.uv is None else self.uv[rows],
            colours=None if self.colours is None else self.colours[rows],
        )


def sound(surface: Surface) -> Surface:
    """The surface without faces that use corners which are not there or not finite."""
    faces = surface.faces[((surface.faces >= 0) & (surface.faces < len(surface.vertices))).all(axis=1)]
    return surface.only(faces[np.isfinite(surface.vertices[faces]).all(axis=(1, 2))])


def with_area(surface: Surface) -> Surface:
    """The surface without faces that have no area to speak of."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return surface.only(surface.faces[area > _FLAT * edges.max(axis=1, initial=0.0) ** 2])


def welded(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> trimesh.Trimesh:
    """One net where corners coincide; every triangle once, none with a corner twice. Flat ones stay: they close it."""
    first, place = trimesh.grouping.unique_rows(vertices, digits=_WELD_DIGITS)
    net = trimesh.Trimesh(vertices[first], place[faces], process=False)
    net.update_faces(net.unique_faces() & (np.diff(np.sort(net.faces, axis=1), axis=1) > 0).all(axis=1))
    net.remove_unreferenced_vertices()
    return net


def shaded(surface: Surface) -> VisualMesh:
    """The surface with vertices split at sharp edges (40 degrees), and a unit normal per vertex, smooth elsewhere."""
    first, place = trimesh.grouping.unique_rows(surface.vertices, digits=_WELD_DIGITS)
    net = trimesh.Trimesh(surface.vertices[first], place[surface.faces], process=False)
    smooth = net.face_adjacency[net.face_adjacency_angles < _SHARP_RAD]
    patch = np.repeat(trimesh.graph.connected_component_labels(smooth, len(net.faces)), 3)
    corners = surface.vertices[surface.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # length: twice the area
    around, total = surface.faces.ravel(), np.zeros((len(patch), 3))
    _, meeting = np.unique(np.stack([place[around], patch], axis=1), axis=0, return_inverse=True)
    np.add.at(total, meeting.ravel(), np.repeat(flat, 3, axis=0))
    _, rows, inverse = np.unique(
        np.stack([around, patch], axis=1), axis=0, return_index=True, return_inverse=True
    )
    split, normals = surface.at(around[rows], inverse.reshape(-1, 3)), total[meeting.ravel()][rows]
    lost = np.linalg.norm(normals, axis=1) < _FLAT * np.linalg.norm(
        flat[rows // 3], axis=1
    )  # a fold of itself
    normals[lost] = flat[rows // 3][lost]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return VisualMesh(split.vertices, split.faces, split.uv, split.texture, split.rgba, normals)
