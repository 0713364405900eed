"""Decompose a welded net into convex pieces: exact for convex parts, CoACD elsewhere. Runs in a child process."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError, cKDTree

Points = Float[np.ndarray, "n 3"]
_MIN_VOLUME_M3, _MIN_THICKNESS_M = 2e-9, 3e-4
_MAX_PIECE_VERTICES, _MAX_CONTACT_VERTICES = 160, 1536
"""Most corners of a piece, and of all together: more make contacts slow."""
_CONVEX_SHARE = 0.985
"""A closed part that fills this share of its convex hull is convex: 3D printers and scanners round at least as much."""
_SHALLOW, _SHALLOW_M = 0.04, 0.003
"""Hollows no deeper than this (share of the size, and metres) are filled: the rim of a can, the seam of a carton."""
_SAMPLES = 60_000
_MAX_SOLID_FACES = 12_000
"""Nets with more faces that could not be simplified are first rebuilt as coarse shells (a closed net: filled)."""
_MAX_RUNS = 4
"""If more hollow parts than this exist, they are decomposed together: every run takes seconds."""
_AT_A_TIME = 8
_COACD_SOLID = {
    # A tenth of the search of CoACD's defaults, for about as many pieces.
    "resolution": 1000,
    "mcts_nodes": 10,
    "mcts_iterations": 40,
    "mcts_max_depth": 2,
    "seed": 0,
    "preprocess_mode": "off",
}
_COACD_SHELL = {**_COACD_SOLID, "preprocess_mode": "on", "preprocess_resolution": 25, "mcts_iterations": 20}
"""A shell has two sides and many triangles: coarser, or it takes minutes."""


def convex_pieces(net: trimesh.Trimesh, concavity: float, max_pieces: int) -> list[Points]:
    """Return corner points of convex pieces that together make the solid of a welded net, metres.

    Open parts become a shell around the surface. `concavity` is CoACD's threshold.
    """
    if trimesh.graph.connected_component_labels(net.face_adjacency, len(net.faces)).max() >= max_pieces:
        return _coacd([net], concavity, max_pieces, _COACD_SHELL)
    hulls: list[Points] = []
    solids: list[trimesh.Trimesh] = []
    shells: list[trimesh.Trimesh] = []
    for part in net.split(only_watertight=False, repair=False):
        if part.is_watertight and part.is_winding_consistent and part.volume < 0:
            continue  # a cavity within another part: nothing can touch it
        try:
            hull = part.convex_hull
        except (QhullError, ValueError):
            continue  # it is flat
        if _is_convex(part, hull):
            hulls.append(np.array(hull.vertices))
        else:
            (solids if part.is_volume and len(part.faces) <= _MAX_SOLID_FACES else shells).append(part)
    if len(solids) > _MAX_RUNS:
        solids, shells = [], solids + shells
    runs = [([part], _COACD_SOLID) for part in solids] + ([(shells, _COACD_SHELL)] if shells else [])
    for i, (together, settings) in enumerate(runs):
        room = max(1, (max_pieces - len(hulls)) // (len(runs) - i))
        hulls += _coacd(together, concavity, room, settings)
    return hulls


def few_corners(hulls: Sequence[Points]) -> list[Points]:
    """Reduce the corners of the pieces until contacts are fast."""
    corners = min(_MAX_PIECE_VERTICES, _MAX_CONTACT_VERTICES // len(hulls))
    return [reduced_hull(hull, corners) for hull in hulls]


def reduced_hull(points: Points, max_corners: int) -> Float[np.ndarray, "m 3"]:
    """Return at most max_corners corners of the convex hull; the bounding box is kept.

    First those that stick out farthest in directions all around, then repeatedly the few that stick out farthest from
    the hull so far.
    """
    corners = points[ConvexHull(points).vertices]
    if len(corners) <= max_corners:
        return np.asarray(corners)
    k = np.arange(max_corners // 2 - 6) + 0.5
    z, turn = 1.0 - 2.0 * k / len(k), k * np.pi * (3.0 - np.sqrt(5.0))  # a Fibonacci lattice
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.sqrt(1.0 - z**2)[:, None]
    directions = np.concatenate([np.eye(3), -np.eye(3), np.column_stack([around, z])])
    unit = (corners - corners.min(axis=0)) / np.ptp(corners, axis=0)
    chosen = set(np.argmax(unit @ directions.T, axis=0).tolist())
    while len(chosen) < max_corners:
        planes = ConvexHull(corners[sorted(chosen)]).equations
        reach = corners @ planes[:, :3].T + planes[:, 3]
        farthest = np.argmax(reach, axis=0)[np.argsort(-reach.max(axis=0))]
        new = [corner for corner in dict.fromkeys(farthest.tolist()) if corner not in chosen]
        if not new:
            break
        chosen.update(new[: min(_AT_A_TIME, max_corners - len(chosen))])
    return np.asarray(corners[sorted(chosen)])


def solid_enough(points: Points) -> bool:
    """Check whether a piece is thick enough for contacts."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return False
    # The thinnest direction is across one of its faces.
    reach = points @ hull.equations[:, :3].T
    return bool(hull.volume > _MIN_VOLUME_M3 and np.ptp(reach, axis=0).min() > _MIN_THICKNESS_M)


def _is_convex(part: trimesh.Trimesh, hull: trimesh.Trimesh) -> bool:
    """Check whether a part fills its convex hull, or covers it everywhere, so that nothing can reach the inside."""
    if part.is_volume and part.volume > _CONVEX_SHARE * hull.volume:
        return True
    on_hull, _ = trimesh.sample.sample_surface(hull, 4_000, seed=0)
    on_part, _ = trimesh.sample.sample_surface(part, _SAMPLES, seed=0)
    bare, _ = cKDTree(np.concatenate([on_part, part.vertices])).query(on_hull)
    between = 2.0 * np.sqrt(hull.area / _SAMPLES)  # random points leave gaps
    return bool(bare.max() < min(_SHALLOW * float(part.extents.max()), _SHALLOW_M) + between)


def _coacd(
    parts: Sequence[trimesh.Trimesh], concavity: float, max_pieces: int, settings: dict[str, Any]
) -> list[Points]:
    import coacd

    net: Any = trimesh.util.concatenate(list(parts))
    if not net.is_volume:
        net.update_faces(net.nondegenerate_faces())  # its preprocessing rejects faces without area
    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(net.vertices, net.faces), threshold=concavity, max_convex_hull=max_pieces, **settings
    )
    hulls = [np.asarray(points, float) for points, _ in found]
    # Stretched to the bounding box of the mesh: CoACD is slightly off, with a shell by a percent.
    low, high = np.concatenate(hulls).min(axis=0), np.concatenate(hulls).max(axis=0)
    return [(h - low) * (net.extents / (high - low)) + net.bounds[0] for h in hulls]
