"""What is seen and what is touched agree; things stand in their natural pose. MuJoCo is the judge."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.marks import long
from torc.generation.grasps import surface_cloud
from torc.objects.library import builtin_object_names, load_object
from torc.objects.models import CollisionPiece
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import StillnessConfig, watch_stillness
from torc.sim.simulated_world import build_world
from torc.workspace.description import Box
from torc.workspace.workspace_files import load_workspace

NAMES = builtin_object_names()
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", [*NAMES[::4], *long(*(name for i, name in enumerate(NAMES) if i % 4))])
def test_matter_begins_where_the_surface_is_seen(name: str) -> None:
    """Just below the visible surface the contact pieces begin; what lies deeper in them is not in the cloud."""
    model = load_object(name)
    points, normals = surface_cloud(model)
    depths = (0.0007, 0.0015, 0.0025, 0.0035)
    inside = [piece.contains(points - d * normals) for piece in model.pieces for d in depths]
    assert np.any(inside, axis=0).mean() > 0.93


BATCHES = [NAMES[i : i + 61] for i in range(0, len(NAMES), 61)]
"""A world holds 64 objects."""


@pytest.mark.parametrize("names", [BATCHES[0], *long(*BATCHES[1:])], ids=lambda names: names[0])
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
