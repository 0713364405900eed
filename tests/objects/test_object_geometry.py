"""What is seen and what is touched agree; things stand in their natural pose. MuJoCo is the judge."""

from dataclasses import replace

import numpy as np
import pytest

from torc.objects.library import builtin_object_names, load_object, object_facts
from torc.objects.models import CollisionPiece, ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.stillness import StillnessConfig, watch_stillness
from torc.sim.world import build_world
from torc.workspace.description import Box
from torc.workspace.files import load_workspace

NAMES = builtin_object_names()
FIRST_OF_KIND = list({object_facts(name).kind: name for name in reversed(NAMES)}.values())[::-1]
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_matter_begins_where_the_surface_is_seen(name: str) -> None:
    """Just below the visible surface the contact pieces begin; three millimetres above it there are none."""
    model = load_object(name)
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in model.visuals])
    points, normals = _on_surface(corners, 400)
    ways, leaves = _cast(corners, points + 0.0004 * normals, normals)
    seen = leaves <= 0  # the others are inside a part, where nobody sees them
    points, normals, way = points[seen], normals[seen], ways[seen]
    assert len(points) > 120
    depths = (0.0007, 0.0015, 0.0025, 0.0035)
    below = np.any([_inside(model, points - d * normals) for d in depths], axis=0)
    above = _inside(model, points + 0.003 * normals) & (way > 0.003)  # no other part of it is that near
    assert below.mean() > 0.93
    assert above.mean() < 0.07


def _on_surface(corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points all over triangles, by area, and the normals there."""
    rng = np.random.default_rng(0)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    u, v = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    points = (weights[:, :, None] * corners[chosen]).sum(axis=1)
    return points, cross[chosen] / area[chosen, None]


def _inside(model: ObjectModel, points: np.ndarray) -> np.ndarray:
    return np.any([piece.contains(points) for piece in model.pieces], axis=0)


def _cast(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far rays go until they meet a triangle, in units of their directions; and in how many parts they begin: those
    that they leave more often than they enter them."""
    a, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ways, leaves = np.full(len(origins), np.inf), np.zeros(len(origins))
    for k, (o, d) in enumerate(zip(origins, directions)):
        h = np.cross(d, e2)
        facing = (e1 * h).sum(axis=1)
        parallel = np.abs(facing) < 1e-14
        f = 1.0 / np.where(parallel, 1.0, facing)
        s = o - a
        u = f * (s * h).sum(axis=1)
        q = np.cross(s, e1)
        v, t = f * (q @ d), f * (e2 * q).sum(axis=1)
        hit = ~parallel & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 0)
        ways[k] = t[hit].min(initial=np.inf)
        leaves[k] = -np.sign(f[hit]).sum()
    return ways, leaves


BATCHES = [NAMES[i : i + 61] for i in range(0, len(NAMES), 61)]
"""A world holds 64 objects."""


@pytest.mark.parametrize("names", BATCHES, ids=lambda names: names[0])
def test_everything_stands_for_three_seconds(names: tuple[str, ...]) -> None:
    """Set on a large table with 0.2 mm to fall, no object turns over, rolls or creeps."""
    workspace = replace(load_workspace(), table=Box("table", (0.0, 0.0, 1.0), (5.0, 5.0, 0.1)))
    placements = []
    for i, name in enumerate(names):
        row, column = divmod(i, 8)
        z = workspace.support_z_m + load_object(name).size_m[2] / 2 + 0.0002
        placements.append(ObjectPlacement(name, name, (0.5 * row - 2, 0.5 * column - 2, z), UPRIGHT))
    world = build_world(Problem("all", "structured", "", names[0], tuple(placements)), None, workspace)
    report = watch_stillness(world, StillnessConfig(np.inf, np.inf, seconds=3.0))
    order = [placement.model for placement in world.problem.ordered()]
    restless = [
        name
        for name, way, angle, speed in zip(order, report.distances_m, report.angles_rad, world.speeds())
        if way > 0.005 or angle > np.deg2rad(6) or speed > 0.01
    ]
    assert restless == []


@pytest.mark.parametrize(
    "piece",
    [
        CollisionPiece("box", (0.01, 0.02, 0.03), (0.1, 0.0, 0.05), (0.5, 0.5, -0.5, 0.5)),
        CollisionPiece("cylinder", (0.02, 0.05), (0.0, 0.1, 0.0), (0.8, 0.6, 0.0, 0.0)),
        CollisionPiece("capsule", (0.02, 0.05), (0.0, 0.1, 0.0), (0.8, 0.0, 0.6, 0.0)),
        CollisionPiece("ellipsoid", (0.02, 0.05, 0.03), (0.0, 0.1, 0.0), (0.8, 0.0, 0.0, 0.6)),
        CollisionPiece("sphere", (0.02,), (0.0, 0.1, 0.0)),
        CollisionPiece("mesh", (), (0.0, 0.1, 0.0), (0.8, 0.6, 0.0, 0.0), 0.05 * np.eye(4, 3)),
    ],
    ids=lambda p: p.kind,
)
def test_volume_bounds_and_support_agree_with_sampled_containment(piece: CollisionPiece) -> None:
    rng = np.random.default_rng(1)
    lower, upper = piece.bounds
    points = rng.uniform(lower, upper, (40_000, 3))
    inside = piece.contains(points)
    assert inside.mean() * np.prod(upper - lower) == pytest.approx(piece.volume_m3, rel=0.05)
    directions = rng.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach = (points[inside] @ directions.T).max(axis=0)
    support = piece.support(directions)
    assert (reach <= support + 1e-9).all()
    assert (support - reach < 0.006).all()
