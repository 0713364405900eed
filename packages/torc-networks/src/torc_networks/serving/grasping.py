"""Handlers for grasps: the geometric planner, on points alone, in the frames of the networks that it stands in for."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.spatial import cKDTree

from torc import Observation
from torc.geometry.transforms import invert, transform_points
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.occlusion.volume import empty_volume
from torc.records import MAX_OBJECTS, GraspSet, SegmentedObject, SegmentedScene
from torc.robots.gripper import GripperDescription
from torc.workspace.description import Workspace
from torc_networks.fields import Fields, request
from torc_networks.grasping.frames import PANDA_TIP_M, along_axes, fingertips
from torc_networks.server import Handler

_NEIGHBOURS = 12
_LEAST_POINTS = 20


class GraspHandlers:
    """`infer` and `grasps`. Nothing is known of hidden space, and all that is told of the gripper is ignored: it is the
    one of the server's own robot.
    """

    def __init__(self, gripper: GripperDescription, workspace: Workspace) -> None:
        self.gripper, self.workspace = gripper, workspace
        self.planner = GeometricGraspPlanner(gripper, workspace.support_z_m)

    def infer(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """{point_cloud (n, 3) of one object, world frame} to {grasps, confidences, num_grasps, widths}: poses of the
        gripper's base, as GraspGen has them.
        """
        fields = request(asked)
        points = fields.finite("point_cloud", (None, 3)).astype(np.float32)
        found = self._planned(
            fields, points, np.zeros(len(points), np.int64), self.workspace.camera.T_world_camera
        )
        Ts = along_axes(found.Ts_world_tcp, -fingertips(self.gripper, found.widths_m))
        told = {"widths": found.widths_m, "num_grasps": len(found)}
        return {"grasps": Ts, "confidences": found.scores, **told}

    def grasps(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """{point_cloud (n, 3), camera frame, object_ids (n), T_world_camera} to {grasps, confidences, widths,
        object_ids}: poses as Contact-GraspNet has them.
        """
        fields = request(asked)
        points = fields.finite("point_cloud", (None, 3))
        ids = fields.array("object_ids", (len(points),), "i").astype(np.int64)
        T_world_camera = fields.pose("T_world_camera")
        world = transform_points(T_world_camera, points).astype(np.float32)
        found = self._planned(fields, world, ids, T_world_camera)
        Ts = invert(T_world_camera) @ found.Ts_world_tcp
        Ts = along_axes(Ts, np.tile([0.0, 0.0, -PANDA_TIP_M], (len(found), 1)))
        return {
            "grasps": Ts,
            "confidences": found.scores,
            "widths": found.widths_m,
            "object_ids": found.object_ids,
        }

    def _planned(
        self,
        fields: Fields,
        points: Float32[np.ndarray, "n 3"],
        ids: Int[np.ndarray, "n"],
        T_world_camera: Float[np.ndarray, "4 4"],
    ) -> GraspSet:
        if len(ids) and ids.max() >= MAX_OBJECTS:
            raise fields.refuse(f"object_ids go up to {ids.max()}; {MAX_OBJECTS - 1} is the most.")
        seed = fields.whole("seed", 0, 2**63) if fields.has("seed") else 0
        scene = scene_of_points(points, ids, T_world_camera)
        return self.planner.plan(scene, empty_volume(self.workspace.grid), np.random.default_rng(seed))


def grasp_handlers(gripper: GripperDescription, workspace: Workspace) -> dict[str, Handler]:
    """The handlers by action."""
    made = GraspHandlers(gripper, workspace)
    return {"infer": made.infer, "grasps": made.grasps}


def scene_of_points(
    points: Float32[np.ndarray, "n 3"], ids: Int[np.ndarray, "n"], T_world_camera: Float[np.ndarray, "4 4"]
) -> SegmentedScene:
    """A scene of points (world frame) without a picture; of which those with a negative id are nobody's."""
    blank = np.zeros((1, 1), np.float32)
    observation = Observation(
        np.zeros((1, 1, 3), np.uint8), blank, np.eye(3), T_world_camera, np.zeros(0), 0.0
    )
    objects = []
    for k in np.unique(ids[ids >= 0]).tolist():
        own = points[ids == k]
        if len(own) >= _LEAST_POINTS:
            pixels = np.zeros((len(own), 2), np.int32)
            normals = _normals(own, T_world_camera[:3, 3])
            objects.append(SegmentedObject(k, own, normals, pixels, len(own)))
    label = np.full((1, 1), -1, np.int16)
    return SegmentedScene(observation, label, tuple(objects), None, points[ids < 0])


def _normals(
    points: Float32[np.ndarray, "n 3"], camera_position: Float[np.ndarray, "3"]
) -> Float32[np.ndarray, "n 3"]:
    """The direction in which each point's neighbours are spread least, towards the camera."""
    _, near = cKDTree(points).query(points, min(_NEIGHBOURS, len(points)))
    around = points[near].astype(float)
    around -= around.mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))[1][:, :, 0]
    away = np.einsum("ij,ij->i", normals, points - camera_position) > 0
    return np.where(away[:, None], -normals, normals).astype(np.float32)
