"""Every compiled kernel that planning a pick may need, used once."""

from dataclasses import replace

import numpy as np

from torc.collision.checks import carved
from torc.motion.config import MotionConfig
from torc.motion.following import follow_line, line_poses
from torc.motion.geometry import rounded_path
from torc.motion.line_context import LineContext
from torc.motion.queries import MotionQuery
from torc.motion.smoothing import corner_blends, shortcut
from torc.motion.space import free_space
from torc.motion.timing import time_path
from torc.motion.tree_search import tree_search


def use_kernels(context: LineContext, config: MotionConfig) -> None:
    """Use them around the rest configuration, whatever comes of it: the path that is shortened need not be free."""
    arm, rng = context.arm, np.random.default_rng(0)
    rest, limits = arm.rest_qpos, (arm.lower, arm.upper)
    context.contacts(rest[None])
    poses = line_poses(context.T_world_tool0, context.approach_axis, 0.01, config.cartesian.step_m)
    follow_line(context.robot, rest[None], poses, *limits)
    world = carved(
        context.world, context.robot, rest, context.width_m, config.carve_margin_m, context.held.possible
    )
    space = free_space(context.robot, world, context.width_m, limits, arm.max_speed, context.held.possible)
    path = np.clip(rest + 0.05 * np.eye(3, arm.dof), *limits)
    space.collides(path)
    space.edge_free(path[0], path[1])
    query = MotionQuery(space, path[0], path[1:])
    tree_search(query, replace(config.search, max_iterations=4), rng)
    path = shortcut(path, 1, space, rng)
    path = np.vstack([path[0], rest, path[-1]])
    blends = corner_blends(path, config.search.blend_rad, space)
    for part in rounded_path(path, blends):
        time_path(part, arm, config.timing)
