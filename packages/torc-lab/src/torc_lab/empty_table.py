"""Plan motions above an empty table, around its fixed boxes and the robot itself, without a picture of the scene."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from torc.collision.collision_world import CollisionConfig, world_from_voxels
from torc.collision.contacts import robot_arrays
from torc.motion.config import MotionConfig
from torc.motion.space import FreeSpace, MotionQuery, free_space
from torc.motion.timed_motions import timed_motion, way_out
from torc.motion.timing import join, rounded_path, time_path
from torc.records import PlanStage, Trajectory
from torc.robots.description import ArmDescription, RobotDescription
from torc.workspace.description import Workspace
from torc_lab.checks import MotionLimits

LIMIT_RAD = 0.05
"""Distance from the joint limits, in addition to the margin of the lab file."""
_PADDING_M = 0.03


def empty_space(
    robot: RobotDescription,
    workspace: Workspace,
    limits: MotionLimits,
    held: Float[np.ndarray, "a 4"] | None = None,
) -> FreeSpace:
    """Return where the arm may be: clear of table, bin, obstacles and itself, with 3 cm of room.

    Args:
        limits: joint limits to keep, with 0.05 rad more.
        held: spheres (x, y, z, radius) of the object in the hand, in the flange's frame, metres.
    """
    bounds = limits.lower + LIMIT_RAD, limits.upper - LIMIT_RAD
    width_m = 0.5 * robot.gripper.max_width_m
    grid, boxes = workspace.grid, workspace.static_boxes()
    config = replace(
        CollisionConfig(),
        padding_m=_PADDING_M,
        gripper_static_padding_m=_PADDING_M,
        attached_static_padding_m=_PADDING_M,
    )
    free, nothing = np.zeros(grid.shape, np.uint8), np.zeros(grid.shape, np.uint64)
    middle, half = np.array([b.center for b in boxes]), 0.5 * np.array([b.size for b in boxes])
    corners = np.hstack([middle - half, middle + half])
    world = world_from_voxels(grid, free, nothing, corners, tuple(b.name for b in boxes), config)
    return free_space(robot_arrays(robot), world, width_m, bounds, robot.arm.max_speed, held)


def trusting(space: FreeSpace, qpos: Float[np.ndarray, "dof"]) -> FreeSpace:
    """Return the space without checks of the held object against those links that it seems to touch at `qpos`.

    A person brought the arm there, so it does not really touch them: the spheres are just too coarse.
    """
    pairs = space.robot.self_pairs
    index, of_held = np.arange(len(pairs)), pairs[:, 1] == len(space.robot.link_start) - 2

    def only(kept: Bool[np.ndarray, "p"]) -> FreeSpace:
        return replace(space, robot=space.robot._replace(self_pairs=pairs[kept]))

    if only(~of_held).collides(qpos[None])[0]:
        return space
    touching = [k for k in index[of_held] if only(~of_held | (index == k)).collides(qpos[None])[0]]
    return only(~np.isin(index, touching))


def motion_above(
    space: FreeSpace,
    arm: ArmDescription,
    qpos: Float[np.ndarray, "dof"],
    goals: Float[np.ndarray, "n dof"],
    rng: np.random.Generator,
) -> Trajectory | None:
    """Return a motion to one of the goals that touches nothing; None if none is found.

    The start `qpos` may be closer to things than motions otherwise come, because a person brought the arm there.

    Args:
        space: where the arm may be.
        qpos: joint positions at the start, radians.
        goals: joint positions of n goals, radians.
    """
    config = MotionConfig()
    out = way_out(space, qpos, rng)
    if out is None:
        return None
    found = timed_motion(MotionQuery(space, out, goals), arm, config, rng)
    if isinstance(found, PlanStage):
        return None
    straight = rounded_path(np.stack([qpos, out]), np.zeros(2))
    return join([*(time_path(part, arm, config.timing) for part in straight), found[0]])
