"""Clean the surfaces of a mesh file, and find the solid behind them.

Orientation becomes consistent; small holes and missing undersides are closed.
"""

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from jaxtyping import Float, Int, UInt8

from torc.objects.models import Quat, VisualMesh

GRAY: Quat = (0.72, 0.72, 0.74, 1.0)
"""Colour of meshes without colours."""
_SHARP_RAD = float(np.deg2rad(40.0))
_WELD_DIGITS = 6
"""Corners that agree to a micrometre are one."""
_FLAT = 1e-6
"""Area relative to the square of the longest edge: above the rounding of single-precision files, and less than a
micrometre for a thing of 0.3 m.
"""
_SMALL_HOLE = 0.4
"""Holes whose rim is shorter than this times the largest extent are closed."""
_UNDERSIDE = 0.04
"""An opening counts as underside if its whole rim is below this share of the height."""
_AGGRESSIONS = (5, 7, 10)
"""Settings of the simplification, from the most faithful to the most eager; torn meshes stop the faithful ones early.
"""


@dataclass(frozen=True, eq=False)
class Surface:
    """One surface of one material, z up, metres.

    Attributes:
        uv: per vertex, v down.
        rgba: multiplies the texture.
        colors: per vertex; replace rgba.
    """

    vertices: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    uv: Float[np.ndarray, "n 2"] | None = None
    texture: UInt8[np.ndarray, "h w 3"] | None = None
    rgba: Quat = GRAY
    colors: UInt8[np.ndarray, "n 3"] | None = None

    def only(self, faces: Int[np.ndarray, "k 3"]) -> "Surface":
        """Return the surface with these faces, without unused vertices."""
        used, inverse = np.unique(faces, return_inverse=True)
        return self.at(used, inverse.reshape(-1, 3))

    def at(self, rows: Int[np.ndarray, "k"], faces: Int[np.ndarray, "l 3"]) -> "Surface":
        """Return a surface of some of the vertices; the faces index those."""
        return replace(
            self,
            vertices=self.vertices[rows],
            faces=faces,
            uv=None if self.uv is None else self.uv[rows],
            colors=None if self.colors is None else self.colors[rows],
        )


def sound(surface: Surface) -> Surface:
    """Return the surface without faces whose corners are missing or not finite."""
    faces = surface.faces[((surface.faces >= 0) & (surface.faces < len(surface.vertices))).all(axis=1)]
    return surface.only(faces[np.isfinite(surface.vertices[faces]).all(axis=(1, 2))])


def with_area(surface: Surface) -> Surface:
    """Return the surface without faces of negligible area."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return surface.only(surface.faces[area > _FLAT * edges.max(axis=1, initial=0.0) ** 2])


def welded(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> trimesh.Trimesh:
    """Weld coinciding corners; keep every triangle once, none with a corner twice. Flat ones stay: they close it."""
    first, place = trimesh.grouping.unique_rows(vertices, digits=_WELD_DIGITS)
    net = trimesh.Trimesh(vertices[first], place[faces], process=False)
    net.update_faces(net.unique_faces() & (np.diff(np.sort(net.faces, axis=1), axis=1) > 0).all(axis=1))
    net.remove_unreferenced_vertices()
    return net


def shaded(surface: Surface) -> VisualMesh:
    """Return the surface split at sharp edges (40 degrees), with a unit normal per vertex, smooth elsewhere."""
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
    own = flat[rows // 3]
    lost = np.linalg.norm(normals, axis=1) < _FLAT * np.linalg.norm(own, axis=1)  # a fold of itself
    normals[lost] = own[lost]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return VisualMesh(split.vertices, split.faces, split.uv, split.texture, split.rgba, normals)


@dataclass(frozen=True, eq=False)
class Solid:
    """A welded net whose triangles face outwards; `turned` if the file's faced inwards."""

    net: trimesh.Trimesh
    turned: bool
    closed_holes: int

    @property
    def closed(self) -> bool:
        """True if there is an inside, and all triangles face outwards."""
        return bool(self.net.is_watertight and self.net.is_winding_consistent)


def solid(net: trimesh.Trimesh) -> Solid:
    """Orient the net's triangles consistently, and close holes that are surely unintended."""
    net = net.copy()
    consistent = bool(net.is_winding_consistent)
    trimesh.repair.fix_winding(net)
    holes = _close_holes(net)
    turned = bool(consistent and net.is_watertight and net.volume < 0)
    # If the file is inconsistent, a part that faces inwards may be a cavity or not: every part becomes a solid.
    trimesh.repair.fix_inversion(net, multibody=not consistent)
    return Solid(net, turned, holes)


def simplified(net: trimesh.Trimesh, max_faces: int) -> trimesh.Trimesh:
    """Return the net with about max_faces triangles, by quadric edge collapse; unchanged if it has no more."""
    if len(net.faces) <= max_faces:
        return net
    center, size = net.vertices.mean(axis=0), float(net.extents.max())
    # The thresholds of the simplification are absolute.
    unit = trimesh.Trimesh((net.vertices - center) / size, net.faces, process=False)
    for aggression in _AGGRESSIONS:
        fewer = unit.simplify_quadric_decimation(face_count=max_faces, aggression=aggression)
        if len(fewer.faces) <= 1.1 * max_faces:
            break
    return trimesh.Trimesh(fewer.vertices * size + center, fewer.faces, process=False)


def _close_holes(net: trimesh.Trimesh) -> int:
    """Close small holes and openings of the underside by fans; other openings (a cup's mouth) stay."""
    open_edges = net.edges[trimesh.grouping.group_rows(net.edges_sorted, require_count=1)]
    vertices, fans = [np.asarray(net.vertices)], [np.asarray(net.faces)]
    low, height, extent = net.bounds[0, 2], net.extents[2], net.extents.max()
    for corners in trimesh.graph.connected_components(open_edges, min_len=3):
        rim = open_edges[np.isin(open_edges[:, 0], corners)]
        if len(np.unique(rim[:, 0])) < len(rim) or len(rim) != len(corners):
            continue  # it crosses another, or is not a loop
        ends = net.vertices[rim]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
        if (ends[..., 2] < low + _UNDERSIDE * height).all() or length < _SMALL_HOLE * extent:
            hub = np.full(len(rim), len(net.vertices) + len(fans) - 1)
            vertices.append(ends[:, 0].mean(axis=0)[None])
            fans.append(np.stack([rim[:, 1], rim[:, 0], hub], axis=1))
    net.vertices, net.faces = np.concatenate(vertices), np.concatenate(fans)
    return len(fans) - 1
