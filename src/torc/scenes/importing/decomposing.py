"""A welded net to convex pieces: exact where a part is convex, CoACD elsewhere. Runs in a child process."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from torc.files.reading import ArraySpec, read_arrays
from torc.scenes.importing.closing import is_closed, parts, signed_volume
from torc.scenes.importing.hulls import thinned
from torc.scenes.importing.preparing import CONTACT_SPECS

NET_FILE, HULLS_FILE = "net.npz", "hulls.npz"
MAX_HULL_VERTICES = 4096
"""Of a piece as it is handed over; a finer one is thinned."""
_MAX_NET_BYTES = 16 * 2**20
_CONVEX_SHARE = 0.985
"""A closed part that fills this much of its convex hull is convex: 3D printers and scanners round no less."""
_SHALLOW, _SHALLOW_M = 0.04, 0.003
"""Hollows no deeper than this (of the size, and metres) are filled: the rim of a can, the seam of a carton."""
_SAMPLES = 60_000
_MAX_SOLID_FACES = 12_000
"""Nets with more, which could not be simplified, are made anew as coarse shells first (of a closed net: filled)."""
_MAX_RUNS = 4
"""More hollow parts than this are decomposed together: every run takes seconds."""
_COACD = {
    # A tenth of the search of CoACD's defaults, for about the same number of pieces.
    "resolution": 1000,
    "mcts_nodes": 10,
    "mcts_iterations": 40,
    "mcts_max_depth": 2,
    "seed": 0,
}
_COACD_SHELL = {**_COACD, "preprocess_mode": "on", "preprocess_resolution": 25, "mcts_iterations": 20}
"""A shell has two sides and many triangles: coarser, or it takes minutes."""
_COACD_SOLID = {**_COACD, "preprocess_mode": "off"}


def decompose(request: Mapping[str, Any], directory: Path) -> dict[str, Any]:
    """Reads the net in `directory` and leaves its convex pieces there: the child process's task."""
    arrays = read_arrays(directory / NET_FILE, CONTACT_SPECS, _MAX_NET_BYTES, "the net")
    vertices, faces = arrays["contact_vertices"], arrays["contact_faces"].astype(np.int64)
    hulls = convex_pieces(vertices, faces, float(request["concavity"]), int(request["max_pieces"]))
    hulls = [thinned(hull, MAX_HULL_VERTICES) for hull in hulls]
    np.savez(directory / HULLS_FILE, **{f"hull_{i}": h for i, h in enumerate(hulls)})  # type: ignore[arg-type]
    return {"hulls": len(hulls)}


def read_hulls(count: int, directory: Path) -> list[Float[np.ndarray, "n 3"]]:
    """What `decompose` left, validated. Raises InputError."""
    specs = {f"hull_{i}": ArraySpec("f", 3, MAX_HULL_VERTICES) for i in range(count)}
    return list(read_arrays(directory / HULLS_FILE, specs, _MAX_NET_BYTES, "the convex pieces").values())


def convex_pieces(
    vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"], concavity: float, max_pieces: int
) -> list[Float[np.ndarray, "k 3"]]:
    """Corner points of convex pieces that together make the solid; of open parts, a shell around the surface."""
    if is_closed(faces):
        # A closed part within another may face inwards: a cavity, which nothing can touch.
        found = [p for p in parts(len(vertices), faces) if signed_volume(vertices, p) > 0]
    else:
        found = parts(len(vertices), faces)
    if len(found) > max_pieces:
        return _coacd(vertices, faces, concavity, max_pieces, shell=True)
    simple: list[tuple[np.ndarray, ...]] = []
    hollow: list[tuple[np.ndarray, ...]] = []
    for part in found:
        points, net = _of_its_own(vertices, part)
        hull = _hull(points)
        if hull is not None:  # else it is flat
            (simple if _is_convex(points, net, hull) else hollow).append((points, net, hull))
    hulls = [hull for *_, hull in simple]
    nets = [(points, net) for points, net, _ in hollow]
    solid = [(points, net) for points, net in nets if is_closed(net) and len(net) <= _MAX_SOLID_FACES]
    shells = [(points, net) for points, net in nets if not is_closed(net) or len(net) > _MAX_SOLID_FACES]
    if len(solid) > _MAX_RUNS:
        solid, shells = [], solid + shells
    if shells:
        shells = [_together(shells)]
    runs = [(*one, False) for one in solid] + [(*one, True) for one in shells]
    for i, (points, net, shell) in enumerate(runs):
        room = max(1, (max_pieces - len(hulls)) // (len(runs) - i))
        hulls += _coacd(points, net, concavity, room, shell)
    return hulls


def _of_its_own(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)


def _together(nets: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    offsets = np.cumsum([0, *(len(points) for points, _ in nets)])
    return np.concatenate([p for p, _ in nets]), np.concatenate(
        [net + o for (_, net), o in zip(nets, offsets)]
    )


def _is_convex(vertices: np.ndarray, faces: np.ndarray, hull: np.ndarray) -> bool:
    if is_closed(faces) and abs(signed_volume(vertices, faces)) > _CONVEX_SHARE * _volume(hull):
        return True
    return _covers(vertices, faces, hull)


def _coacd(
    vertices: np.ndarray, faces: np.ndarray, concavity: float, max_pieces: int, shell: bool
) -> list[np.ndarray]:
    import coacd

    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(vertices, faces),
        threshold=concavity,
        max_convex_hull=max_pieces,
        **(_COACD_SHELL if shell else _COACD_SOLID),
    )
    hulls = [h for points, _ in found if (h := _hull(np.asarray(points, float))) is not None]
    return _fit(hulls, vertices) if hulls else []


def _fit(hulls: list[np.ndarray], vertices: np.ndarray) -> list[np.ndarray]:
    """The pieces stretched to the bounding box of the mesh: CoACD is off by a little, with a shell by a percent."""
    points = np.concatenate(hulls)
    low, high = points.min(axis=0), points.max(axis=0)
    wanted_low, wanted_high = vertices.min(axis=0), vertices.max(axis=0)
    factor = (wanted_high - wanted_low) / (high - low)
    return [(h - low) * factor + wanted_low for h in hulls]


def _hull(points: np.ndarray) -> Float[np.ndarray, "k 3"] | None:
    """The corners of the convex hull; None if it is flat."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return None


def _volume(points: np.ndarray) -> float:
    from scipy.spatial import ConvexHull

    return float(ConvexHull(points).volume)


def _covers(vertices: np.ndarray, faces: np.ndarray, hull: np.ndarray) -> bool:
    """Whether the surface lies all over its convex hull, so that nothing can reach what is inside."""
    from scipy.spatial import ConvexHull, cKDTree

    rng = np.random.default_rng(0)
    skin = ConvexHull(hull)
    on_hull = _spread(hull, skin.simplices, 4_000, rng)
    on_mesh = np.concatenate([_spread(vertices, faces, _SAMPLES, rng), vertices])
    bare, _ = cKDTree(on_mesh).query(on_hull)
    between = 2.0 * np.sqrt(skin.area / _SAMPLES)  # random points leave gaps
    allowed = min(_SHALLOW * float(np.ptp(vertices, axis=0).max()), _SHALLOW_M)
    return bool(bare.max() < allowed + between)


def _spread(vertices: np.ndarray, faces: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Random points on triangles, evenly by area."""
    c = vertices[faces]
    area = np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1)
    face = rng.choice(len(faces), count, p=area / area.sum())
    r, s = rng.random((2, count))
    r, s = np.where(r + s > 1, 1 - r, r), np.where(r + s > 1, 1 - s, s)
    return np.asarray(
        c[face, 0] + r[:, None] * (c[face, 1] - c[face, 0]) + s[:, None] * (c[face, 2] - c[face, 0])
    )
