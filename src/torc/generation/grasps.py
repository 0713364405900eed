"""Whether the robot can grasp an object at all, with nothing else on the table, judged on the full model.

The paper prunes candidate targets by "ground-truth grasps that are both collision-free (with the static scene) and
IK-feasible" (Simulated Dataset, step 4). Ours come from the grasp planner that the robot uses later, but on a cloud of
the object's whole surface, with everything else removed.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from torc.collision.collision_world import build_collision_world
from torc.generation.surfaces import placed, surface_cloud
from torc.geometry.transforms import Pose
from torc.grasping.config import CloudConfig, GraspConfig, SelectionConfig
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.validity import evaluate_grasps
from torc.objects.library import load_object
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
