"""The handler for motions: the free motions of the sampling planner, in a world of voxels and boxes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from torc.collision.collision_world import FREE, SURFACE, CollisionConfig, CollisionWorld, world_from_voxels
from torc.collision.contacts import robot_arrays
from torc.motion.config import MotionConfig
from torc.motion.space import MotionQuery, free_space
from torc.motion.timed_motions import timed_motion
from torc.records import PlanStage, VoxelGrid
from torc.robots.description import RobotDescription
from torc_networks.fields import Fields, request
from torc_networks.server import Handler


def plan_handler(robot: RobotDescription, config: MotionConfig) -> Handler:
    """{start (dof), goals (g, dof), joint_names, seed, and the fields of `torc_networks.motion.world.world_fields`} to
    {times, positions}, or {failure: why there is no motion}.
    """
    arm, arrays = robot.arm, robot_arrays(robot)

    def plan(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        if tuple(asked.get("joint_names") or ()) != arm.joint_names:
            raise fields.refuse(
                f"the server's robot is {robot.name}, with the joints {', '.join(arm.joint_names)}."
            )
        start, goals = fields.finite("start", (arm.dof,)), fields.finite("goals", (None, arm.dof))
        width, attached = fields.number("width"), fields.finite("attached", (None, 4))
        if not 0 <= width <= robot.gripper.max_width_m + 1e-6 or not len(goals):
            raise fields.refuse("it needs a goal, and an opening that the gripper has.")
        limits = arm.lower, arm.upper
        space = free_space(arrays, _world(fields), width, limits, arm.max_speed, attached)
        rng = np.random.default_rng(fields.whole("seed", 0, 2**63))
        found = timed_motion(MotionQuery(space, start, goals), arm, config, rng)
        if isinstance(found, PlanStage):
            return {"failure": f"nothing in {config.search.max_iterations} samples."}
        return {"times": found[0].times_s, "positions": found[0].qpos}

    return plan


def _world(fields: Fields) -> CollisionWorld:
    """Voxels below zero are obstacles without an owner."""
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
