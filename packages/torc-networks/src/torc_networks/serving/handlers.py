"""torc's own parts as handlers of a server, by action; they need no GPU and no large network."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int, UInt8
from scipy.spatial import cKDTree

from torc import Observation
from torc.collision.collision_world import FREE, SURFACE, CollisionConfig, CollisionWorld, world_from_voxels
from torc.collision.contacts import robot_arrays
from torc.errors import UnknownNameError
from torc.geometry.transforms import invert, transform_points
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.motion.config import MotionConfig
from torc.motion.space import MotionQuery, free_space
from torc.motion.timed_motions import timed_motion
from torc.occlusion.volume import empty_volume
from torc.perception.embedded.perception import EmbeddedPerception
from torc.perception.stereo import SgbmConfig, SgbmMatcher
from torc.records import MAX_OBJECTS, GraspSet, PlanStage, SegmentedObject, SegmentedScene, VoxelGrid
from torc.robots.description import RobotDescription
from torc.workspace.description import Workspace
from torc_networks.fields import Fields, request
from torc_networks.grasping.frames import PANDA_TIP_M, along_axes, fingertips
from torc_networks.server import Handler

ACTIONS = ("segment", "stereo", "infer", "grasps", "plan")
"""What torc can serve: masks; disparities; grasps as GraspGen, and as Contact-GraspNet gives them; free motions."""
_MOST_DISPARITY_PX = 1024
_NEIGHBOURS = 12
_LEAST_POINTS = 20


def own_handlers(
    robot: RobotDescription, workspace: Workspace, actions: tuple[str, ...] = ACTIONS
) -> dict[str, Handler]:
    """Return the handlers of these actions. Raises UnknownNameError for an unknown one."""
    for name in actions:
        if name not in ACTIONS:
            raise UnknownNameError("action", name, [*ACTIONS])
    parts = OwnParts(robot, workspace)
    return {name: getattr(parts, name) for name in actions}


class OwnParts:
    """torc's own parts of one robot and workspace, a handler per action; docs/networks.md lists their fields.

    The gripper is that of the robot, whatever a request says of it, and nothing is known of hidden space.
    """

    def __init__(self, robot: RobotDescription, workspace: Workspace) -> None:
        self.robot, self.workspace = robot, workspace
        self.arrays, self.motion = robot_arrays(robot), MotionConfig()
        self.perception = EmbeddedPerception(workspace=workspace)
        self.planner = GeometricGraspPlanner(robot.gripper, workspace.support_z_m)

    def segment(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the masks of `--perception embedded`; a prompt is ignored."""
        fields = request(asked)
        rgb = fields.bytes("rgb", (None, None, 3))
        depth = fields.array("depth_m", rgb.shape[:2], "f").astype(np.float32)
        K, T_world_camera = fields.finite("K", (3, 3)), fields.pose("T_world_camera")
        observation = Observation(rgb, depth, K, T_world_camera, np.zeros(0), 0.0)
        label, scores = self.perception.masks(observation)
        return {"labels": label, "scores": scores}

    def stereo(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return a disparity by semi-global block matching; the pictures may also be in colour."""
        fields = request(asked)
        left, right = (_grey(fields, side) for side in ("left", "right"))
        if left.shape != right.shape:
            raise fields.refuse(f"the left picture is {left.shape}, the right one {right.shape}.")
        most = fields.whole("max_disparity", 1, _MOST_DISPARITY_PX)
        disparity, confidence = SgbmMatcher(most, SgbmConfig()).match(left, right)
        return {"disparity": disparity, "confidence": confidence}

    def infer(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return grasps by the geometric planner: poses of the gripper's base, as GraspGen has them."""
        fields = request(asked)
        points = fields.finite("point_cloud", (None, 3)).astype(np.float32)
        ids = np.zeros(len(points), np.int64)
        found = self._grasps(fields, points, ids, self.workspace.camera.T_world_camera)
        Ts = along_axes(found.Ts_world_tcp, -fingertips(self.robot.gripper, found.widths_m))
        numbers = {"confidences": found.scores, "widths": found.widths_m, "num_grasps": len(found)}
        return {"grasps": Ts, **numbers}

    def grasps(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return grasps by the geometric planner: poses as Contact-GraspNet has them."""
        fields = request(asked)
        points = fields.finite("point_cloud", (None, 3))
        ids = fields.array("object_ids", (len(points),), "i").astype(np.int64)
        T_world_camera = fields.pose("T_world_camera")
        world = transform_points(T_world_camera, points).astype(np.float32)
        found = self._grasps(fields, world, ids, T_world_camera)
        Ts = invert(T_world_camera) @ found.Ts_world_tcp
        Ts = along_axes(Ts, np.tile([0.0, 0.0, -PANDA_TIP_M], (len(found), 1)))
        numbers = {"confidences": found.scores, "widths": found.widths_m, "object_ids": found.object_ids}
        return {"grasps": Ts, **numbers}

    def _grasps(
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

    def plan(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return a free motion by the sampling planner."""
        fields, arm = request(asked), self.robot.arm
        if tuple(asked.get("joint_names") or ()) != arm.joint_names:
            raise fields.refuse(
                f"the server's robot is {self.robot.name}, with the joints {', '.join(arm.joint_names)}."
            )
        start, goals = fields.finite("start", (arm.dof,)), fields.finite("goals", (None, arm.dof))
        width, attached = fields.number("width"), fields.finite("attached", (None, 4))
        if not 0 <= width <= self.robot.gripper.max_width_m + 1e-6 or not len(goals):
            raise fields.refuse("it needs a goal, and an opening that the gripper has.")
        limits = arm.lower, arm.upper
        space = free_space(self.arrays, _world(fields), width, limits, arm.max_speed, attached)
        rng = np.random.default_rng(fields.whole("seed", 0, 2**63))
        found = timed_motion(MotionQuery(space, start, goals), arm, self.motion, rng)
        if isinstance(found, PlanStage):
            return {"failure": f"nothing in {self.motion.search.max_iterations} samples."}
        return {"times": found[0].times_s, "positions": found[0].qpos}


def _grey(fields: Fields, side: str) -> UInt8[np.ndarray, "h w"]:
    if getattr(fields.values.get(side), "ndim", 0) == 3:
        return np.asarray(cv2.cvtColor(fields.bytes(side, (None, None, 3)), cv2.COLOR_RGB2GRAY), np.uint8)
    return fields.bytes(side, (None, None))


def scene_of_points(
    points: Float32[np.ndarray, "n 3"], ids: Int[np.ndarray, "n"], T_world_camera: Float[np.ndarray, "4 4"]
) -> SegmentedScene:
    """Return a scene of points (world frame) without a picture; points with a negative id belong to no object."""
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
    """Return the direction in which each point's neighbours are spread least, towards the camera."""
    _, near = cKDTree(points).query(points, min(_NEIGHBOURS, len(points)))
    around = points[near].astype(float)
    around -= around.mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))[1][:, :, 0]
    away = np.einsum("ij,ij->i", normals, points - camera_position) > 0
    return np.where(away[:, None], -normals, normals).astype(np.float32)


def _world(fields: Fields) -> CollisionWorld:
    """Return the world of a request; voxels below zero are obstacles without an owner."""
    esdf, boxes = fields.finite("esdf", (None, None, None)), fields.finite("boxes", (None, 6))
    size, pose = fields.number("voxel_size"), fields.finite("pose", (7,))
    if not esdf.size or size <= 0 or np.abs(pose[3:] - [1, 0, 0, 0]).max() > 1e-6:
        raise fields.refuse("it needs voxels, and a grid that is not turned.")
    grid = VoxelGrid(pose[:3] - 0.5 * size * np.array(esdf.shape), size, esdf.shape)
    arm, gripper, attached = fields.finite("padding", (3, 2))
    config = CollisionConfig(
        padding_m=arm[0],
        gripper_padding_m=gripper[0],
        gripper_static_padding_m=gripper[1],
        attached_padding_m=attached[0],
        attached_static_padding_m=attached[1],
        self_padding_m=fields.number("self_padding"),
    )
    kind = np.where(esdf < 0, np.uint8(SURFACE), np.uint8(FREE))
    names = tuple(f"box {k}" for k in range(len(boxes)))
    return world_from_voxels(grid, kind, np.zeros(kind.shape, np.uint64), boxes, names, config)
