"""The whole surface of an object model as a cloud, as if seen by a camera from everywhere."""

from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from torc.geometry.transforms import Pose
from torc.objects.models import ObjectModel, VisualMesh

SPACING_M = 0.004
"""Distance between neighbouring points: the grasp planner thins its clouds to it."""
_PER_SPACING = 2.5
_INSIDE_M = 0.003
"""How far beyond a surface a contact piece must reach for that surface to be inside the object. Surfaces and pieces
agree within 2 mm.
"""

_AT_ONCE = 20_000
"""Points at once: a contact piece of many sides takes 8 kB for each."""

Cloud = tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]


@lru_cache(maxsize=128)
def surface_cloud(model: ObjectModel) -> Cloud:
    """Return points and outward unit normals all over a model, model frame, about SPACING_M apart; deterministic.

    Surfaces that are buried in another part of the object are left out. The two sides of a thin wall keep their own
    points: averaged over a cube, like clouds from a camera, they would cancel out.
    """
    clouds = [_samples(mesh) for mesh in model.visuals]
    points, normals = (np.concatenate(arrays) for arrays in zip(*clouds))
    open_ = ~_buried(model, points + _INSIDE_M * normals)
    if open_.any():  # for an object that lies within its own pieces, keep everything
        points, normals = points[open_], normals[open_]
    keep = _one_per_cube_and_side(points, normals)
    return points[keep], normals[keep]


def placed(
    points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], T_world_object: Pose
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Transform a cloud from the model frame to the world frame."""
    R = T_world_object[:3, :3]
    return points @ R.T + T_world_object[:3, 3], normals @ R.T


def _samples(mesh: VisualMesh) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Return points spread evenly at random over the triangles, and the triangles' normals there."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    cross = np.cross(b - a, c - a)
    double_area = np.linalg.norm(cross, axis=1)
    solid = double_area > 1e-12
    a, b, c, cross, double_area = (v[solid] for v in (a, b, c, cross, double_area))
    total = 0.5 * double_area.sum()
    if total <= 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    rng = np.random.default_rng(0)
    count = int(np.ceil(total / (SPACING_M / _PER_SPACING) ** 2))
    # One point every total / count of area: large triangles get their share, small ones theirs on average.
    at = (np.arange(count) + rng.random(count)) * (2 * total / count)
    face = np.minimum(np.searchsorted(np.cumsum(double_area), at, side="right"), len(a) - 1)
    u, v = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)[:, :, None]
    corners = np.stack([a[face], b[face], c[face]], axis=1)
    return (weights * corners).sum(axis=1), (cross / double_area[:, None])[face]


def _buried(model: ObjectModel, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
    inside = np.zeros(len(points), dtype=bool)
    for piece in model.pieces:
        lower, upper = piece.bounds
        near = ((points > lower - 1e-6) & (points < upper + 1e-6)).all(axis=1)
        asked = np.flatnonzero(near & ~inside)
        for some in np.split(asked, range(_AT_ONCE, len(asked), _AT_ONCE)):
            inside[some] = piece.contains(points[some])
    return inside


def _one_per_cube_and_side(
    points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]
) -> Int[np.ndarray, "m"]:
    """Return the first point of every cube for each of the six directions that its surface may mainly face."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.int64)
    index = np.floor(points / SPACING_M).astype(np.int64)
    index -= index.min(axis=0)
    n = index.max(axis=0) + 1
    axis = np.argmax(np.abs(normals), axis=1)
    side = 2 * axis + (normals[np.arange(len(normals)), axis] > 0)
    key = ((index[:, 0] * n[1] + index[:, 1]) * n[2] + index[:, 2]) * 6 + side
    return np.unique(key, return_index=True)[1]
