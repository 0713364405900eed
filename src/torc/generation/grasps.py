"""Whether the robot can grasp an object at all, with nothing else on the table, judged on the full model.

The paper prunes candidate targets by "ground-truth grasps that are both collision-free (with the static scene) and
IK-feasible" (Simulated Dataset, step 4). Ours come from the grasp planner that the robot uses later, but on a cloud of
the object's whole surface, with everything else removed.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from torc.collision.collision_world import build_collision_world
from torc.geometry.transforms import Pose
from torc.grasping.config import CloudConfig, GraspConfig, SelectionConfig
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.validity import evaluate_grasps
from torc.objects.library import load_object
from torc.objects.models import ObjectModel, VisualMesh
from torc.records import (
    BACKGROUND,
    EMPTY,
    TARGET_ID,
    GraspStatus,
    Observation,
    OcclusionVolume,
    SegmentedObject,
    SegmentedScene,
)
from torc.robots.description import RobotDescription
from torc.workspace.description import Workspace

SPACING_M = 0.004
"""Distance between neighbouring points: the grasp planner thins its clouds to it."""
_PER_SPACING = 2.5
_INSIDE_M = 0.003
"""How far beyond a surface a contact piece must reach for that surface to be inside the object. Surfaces and pieces
agree within 2 mm.
"""
_AT_ONCE = 20_000
"""Points at once: a contact piece of many sides takes 8 kB for each."""
# The cloud has its spacing already, and more thinning would merge the two sides of thin walls. A few grasps of
# each object show whether there is one.
_CONFIG = GraspConfig(clouds=CloudConfig(voxel_m=0.001), selection=SelectionConfig(max_per_object=12))


@dataclass(frozen=True)
class ModelGrasping:
    """Grasps on full models; those that deliver with a lower probability than min_score do not count."""

    robot: RobotDescription
    workspace: Workspace
    min_score: float = 0.5

    def graspable(self, model: str, T_world_object: Pose) -> bool:
        """True if the robot has a promising grasp of a model at a pose, with nothing else on the table.

        The answer is deterministic. Raises UnknownNameError.
        """
        points, normals = placed(*surface_cloud(load_object(model)), T_world_object)
        scene, volume = _alone(points, normals, self.workspace)
        grasps = self._planner.plan(scene, volume, np.random.default_rng(0))
        report = evaluate_grasps(grasps, scene, build_collision_world(volume, self.workspace), self.robot)
        scores = grasps.scores[report.status == GraspStatus.VALID]
        return bool(scores.max(initial=0.0) >= self.min_score)

    @cached_property
    def _planner(self) -> GeometricGraspPlanner:
        return GeometricGraspPlanner(self.robot.gripper, self.workspace.support_z_m, _CONFIG)


def _alone(
    points: np.ndarray, normals: np.ndarray, workspace: Workspace
) -> tuple[SegmentedScene, OcclusionVolume]:
    """Return the records of a world in which one object has been seen from all sides and everything else is free."""
    grid, mount = workspace.grid, workspace.camera
    rgb, depth_m = np.zeros((1, 1, 3), np.uint8), np.zeros((1, 1), np.float32)
    blank = Observation(rgb, depth_m, mount.K, mount.T_world_camera, qpos=np.zeros(0), stamp_s=0.0)
    seen = SegmentedObject(
        TARGET_ID,
        points.astype(np.float32),
        normals.astype(np.float32),
        pixels=np.zeros((len(points), 2), np.int32),
        pixel_count=2 * len(points),
    )
    labels = np.full((1, 1), BACKGROUND, np.int16)
    scene = SegmentedScene(blank, labels, (seen,), TARGET_ID, np.zeros((0, 3), np.float32))
    surface = np.full(grid.shape, EMPTY, np.int16)
    index = grid.index_of(points)
    surface[tuple(index[grid.contains(index)].T)] = TARGET_ID
    known = np.ones(grid.shape, dtype=bool)
    return scene, OcclusionVolume(grid, known, np.zeros(grid.shape, np.uint64), surface, 1)


@lru_cache(maxsize=128)
def surface_cloud(model: ObjectModel) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
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
