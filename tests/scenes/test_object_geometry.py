"""What is seen and what is touched agree; things stand in their natural pose. MuJoCo is the judge."""

import mujoco
import numpy as np
import pytest
from scenes_mujoco import CONTACT_GROUP, VISUAL_GROUP, mujoco_scene

from torc.scenes.library import load_object, object_names
from torc.scenes.library.catalogue import all_kinds
from torc.scenes.models import CollisionPiece
from torc.scenes.problem import ObjectPlacement

FIRST_OF_KIND = [kind.variants[0].name for kind in all_kinds()]
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", object_names())
def test_bounding_boxes_of_visuals_and_pieces_agree(name: str) -> None:
    model = load_object(name)
    vertices = np.concatenate([mesh.vertices for mesh in model.visuals])
    half = np.array(model.size_m) / 2
    np.testing.assert_allclose(vertices.min(axis=0), -half, atol=0.003)
    np.testing.assert_allclose(vertices.max(axis=0), half, atol=0.003)


@pytest.mark.parametrize("name", FIRST_OF_KIND)
def test_rays_hit_visuals_and_pieces_at_the_same_depth(name: str) -> None:
    model = mujoco_scene([ObjectPlacement("thing", name, (0.0, 0.0, 0.0), UPRIGHT)], None, True)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    seen, touched = _depths(model, data, VISUAL_GROUP, name), _depths(model, data, CONTACT_GROUP, name)
    both = (seen > 0) & (touched > 0)
    either = (seen > 0) | (touched > 0)
    assert both.sum() > 200
    assert both.sum() / either.sum() > 0.93
    error = np.abs(seen - touched)[both]
    assert np.median(error) < 0.0011
    assert np.quantile(error, 0.93) < 0.0036  # along the ray; less across the surface


def _depths(model: mujoco.MjModel, data: mujoco.MjData, group: int, name: str) -> np.ndarray:
    """Depth along rays from fourteen sides towards the object; -1 where nothing is hit."""
    size = np.array(load_object(name).size_m)
    sides = [np.array(s, dtype=float) for s in np.ndindex(3, 3, 3)]
    eyes = [s - 1 for s in sides if np.abs(s - 1).sum() in (1, 3)]
    rng = np.random.default_rng(0)
    aims = rng.uniform(-0.48, 0.48, (80, 3)) * size
    groups = np.zeros(6, dtype=np.uint8)
    groups[group] = 1
    depths = []
    for eye in eyes:
        origin = 1.5 * eye / np.linalg.norm(eye)
        rays = aims - origin
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        depths += [_ray(model, data, origin, ray, groups) for ray in rays]
    return np.array(depths)


def _ray(
    model: mujoco.MjModel, data: mujoco.MjData, origin: np.ndarray, ray: np.ndarray, groups: np.ndarray
) -> float:
    geom = np.array([-1], dtype=np.int32)
    return float(mujoco.mj_ray(model, data, origin, ray, groups, 1, -1, geom))


def test_everything_stands_in_its_natural_pose() -> None:
    """Set on a table with 1 mm to fall, no object turns over or travels within a second."""
    names = object_names()
    placements = []
    for i, name in enumerate(names):
        row, column = divmod(i, 10)
        z = load_object(name).size_m[2] / 2 + 0.001
        placements.append(ObjectPlacement(name, name, (0.4 * row, 0.4 * column, z), UPRIGHT))
    model = mujoco_scene(placements, 0.0, False)
    data = mujoco.MjData(model)
    start = np.array([p.position for p in placements])
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    tilt = data.xmat[1:].reshape(-1, 3, 3)[:, 2, 2]
    travel = np.linalg.norm((data.xpos[1:] - start)[:, :2], axis=1)
    restless = [
        n for n, t, d in zip(names, tilt, travel, strict=True) if t < np.cos(np.deg2rad(8)) or d > 0.008
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
