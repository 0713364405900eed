"""The solid behind a surface: consistent orientation, small holes and missing undersides closed. Welded nets only."""

from dataclasses import dataclass

import numpy as np
import trimesh

_SMALL_HOLE = 0.4
"""Holes whose rim is shorter than this times the largest extent are closed."""
_UNDERSIDE = 0.04
"""An opening counts as underside if its whole rim is lower than this share of the height."""
_AGGRESSIONS = (5, 7, 10)
"""Of the simplification, from the truest to the most eager; torn meshes stop the true ones early."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A welded net.

    Attributes:
        net: the triangles.
        turned: the file's triangles faced inwards; here they face outwards.
        closed_holes: how many holes were closed.
    """

    net: trimesh.Trimesh
    turned: bool
    closed_holes: int

    @property
    def closed(self) -> bool:
        """Whether there is an inside, and all triangles face outwards."""
        return bool(self.net.is_watertight and self.net.is_winding_consistent)


def solid(net: trimesh.Trimesh) -> Solid:
    """The net with its triangles turned the same way, and its holes closed where that is surely meant."""
    net = net.copy()
    consistent = bool(net.is_winding_consistent)
    trimesh.repair.fix_winding(net)
    holes = _close_holes(net)
    turned = bool(consistent and net.is_watertight and net.volume < 0)
    # Where the file is not consistent, what faces inwards cannot be told from a cavity: every part becomes a solid.
    trimesh.repair.fix_inversion(net, multibody=not consistent)
    return Solid(net, turned, holes)


def simplified(net: trimesh.Trimesh, max_faces: int) -> trimesh.Trimesh:
    """The net with about max_faces triangles, by quadric edge collapse; as it is if it has no more."""
    if len(net.faces) <= max_faces:
        return net
    center, size = net.vertices.mean(axis=0), float(net.extents.max())
    unit = trimesh.Trimesh(
        (net.vertices - center) / size, net.faces, process=False
    )  # its thresholds are absolute
    for aggression in _AGGRESSIONS:
        fewer = unit.simplify_quadric_decimation(face_count=max_faces, aggression=aggression)
        if len(fewer.faces) <= 1.1 * max_faces:
            break
    return trimesh.Trimesh(fewer.vertices * size + center, fewer.faces, process=False)


def _close_holes(net: trimesh.Trimesh) -> int:
    """Fans over small holes and over openings of the underside; other openings (a cup's mouth) stay."""
    open_edges = net.edges[trimesh.grouping.group_rows(net.edges_sorted, require_count=1)]
    vertices, fans = [np.asarray(net.vertices)], [np.asarray(net.faces)]
    low, height, extent = net.bounds[0, 2], net.extents[2], net.extents.max()
    for corners in trimesh.graph.connected_components(open_edges, min_len=3):
        rim = open_edges[np.isin(open_edges[:, 0], corners)]
        if len(np.unique(rim[:, 0])) < len(rim) or len(rim) != len(corners):
            continue  # it crosses another, or is no loop
        ends = net.vertices[rim]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
        if (ends[..., 2] < low + _UNDERSIDE * height).all() or length < _SMALL_HOLE * extent:
            hub = np.full(len(rim), len(net.vertices) + len(fans) - 1)
            vertices.append(ends[:, 0].mean(axis=0)[None])
            fans.append(np.stack([rim[:, 1], rim[:, 0], hub], axis=1))
    net.vertices, net.faces = np.concatenate(vertices), np.concatenate(fans)
    return len(fans) - 1
