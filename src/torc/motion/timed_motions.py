"""Plan free motions: search, shorten, round, time, and check once more."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from torc.motion.config import MotionConfig, SearchConfig
from torc.motion.search import corner_blends, shortcut, tree_search
from torc.motion.space import FreeSpace, MotionQuery, loosened
from torc.motion.timing import join, rounded_path, time_path
from torc.records import PlanStage, Trajectory
from torc.robots.description import ArmDescription, Qpos


def free_path(
    query: MotionQuery, config: SearchConfig, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "m dof"], int] | None:
    """Return a free polyline from the start to one of the goals and that goal's index; None if none is found.

    Only the soonest config.goals free goals are considered: the first that a straight edge reaches is taken; else a
    tree search decides. The start must be free.
    """
    space, start = query.space, query.start
    order = query.soonest_free(config.goals)
    if len(order) == 0 or space.collides(start[None])[0]:
        return None
    for chosen in order:
        if space.edge_free(start, query.goals[chosen]):
            return np.stack([start, query.goals[chosen]]), int(chosen)
    path = tree_search(query.among(order), config, rng)
    if path is None:
        return None
    chosen = int(np.argmin(np.linalg.norm(query.goals - path[-1], axis=1)))
    return shortcut(path, config.shortcut_rounds, space, rng), chosen


def timed_motion(
    query: MotionQuery, arm: ArmDescription, config: MotionConfig, rng: np.random.Generator
) -> tuple[Trajectory, int] | PlanStage:
    """Return a free, timed motion to one of the goals and that goal's index, or the stage that failed (FREE or TIMING).

    An edge is checked at steps. A path that grazes an obstacle between them shows in the trajectory, which is checked
    finely; then the search is repeated with smaller steps.
    """
    failed, space = PlanStage.FREE, query.space
    for refinement in range(config.search.refinements + 1):
        finer = replace(query, space=replace(space, step_m=space.step_m / 2**refinement))
        found = free_path(finer, config.search, rng)
        if found is None:
            return failed
        trajectory = _timed(found[0], finer.space, arm, config)
        if trajectory is not None:
            return trajectory, found[1]
        failed = PlanStage.TIMING
    return failed


def _timed(
    path: Float[np.ndarray, "m dof"], space: FreeSpace, arm: ArmDescription, config: MotionConfig
) -> Trajectory | None:
    """Time the polyline with rounded corners, or, if that is not free after all, with stops at the corners."""
    if np.all(np.abs(path - path[0]) < 1e-9):
        return Trajectory(np.array([0.0, config.timing.sample_s]), path[[0, 0]], np.zeros((2, path.shape[1])))
    strict = loosened(space, config.search.grazing_m)
    for blends in (corner_blends(path, config.search.blend_rad, space), np.zeros(len(path))):
        trajectory = join([time_path(part, arm, config.timing) for part in rounded_path(path, blends)])
        if not strict.collides(trajectory.qpos).any():
            return trajectory
        if not blends.any():
            break
    return None


_DEPTHS_M = (0.005, 0.010, 0.015, 0.020, 0.030)
_RADII_RAD = (0.03, 0.1, 0.3)
_TRIES = 200


def way_out(space: FreeSpace, start: Qpos, rng: np.random.Generator) -> Qpos | None:
    """Return the nearest free configuration found on a straight edge without deeper contact than at the start.

    The start itself if it is free. None if its contact is deeper than 3 cm (paddings included) or nothing free is near.
    """
    if not space.collides(start[None])[0]:
        return start
    for depth in _DEPTHS_M:
        looser = loosened(space, depth, itself_too=True)
        if looser.collides(start[None])[0]:
            continue
        for radius in _RADII_RAD:
            offsets = rng.uniform(-radius, radius, (_TRIES, len(start)))
            near = np.clip(start + offsets, space.lower, space.upper)
            free = near[~space.collides(near)]
            free = free[~looser.edges_collide(start, free)]
            if len(free):
                return free[np.argmin(space.seconds_between(start, free))]
        return None
    return None
