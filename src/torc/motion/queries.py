"""Free motions: search, shorten, round, time, and check once more."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from torc.motion.config import MotionConfig, SearchConfig
from torc.motion.geometry import rounded_path
from torc.motion.smoothing import corner_blends, shortcut
from torc.motion.space import FreeSpace, loosened
from torc.motion.timing import join, time_path
from torc.records import PlanStage, Trajectory
from torc.robots.description import ArmDescription


def free_path(
    space: FreeSpace,
    start: Float[np.ndarray, "dof"],
    goals: Float[np.ndarray, "g dof"],
    cost: Float[np.ndarray, "g"],
    config: SearchConfig,
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "m dof"], int] | None:
    """A free polyline from start to one of the goals and that goal's index; None if none is found.

    cost: seconds that the choice of each goal costs later. Only the cheapest config.goals are looked at: the
    first that a straight edge reaches is taken; else a tree search decides. Start and goals must be free.
    """
    usable = np.flatnonzero(~space.collides(goals))
    if len(usable) == 0 or space.collides(start[None])[0]:
        return None
    later = space.seconds_between(start, goals[usable]) + cost[usable]
    order = usable[np.argsort(later, kind="stable")][: config.goals]
    for chosen in order:
        if space.edge_free(start, goals[chosen]):
            return np.stack([start, goals[chosen]]), int(chosen)
    path = _search(space, start, goals[order], config, rng)
    if path is None:
        return None
    chosen = int(np.argmin(np.linalg.norm(goals - path[-1], axis=1)))
    path[0], path[-1] = start, goals[chosen]
    return shortcut(path, config.shortcut_rounds, space, rng), chosen


def timed_motion(
    space: FreeSpace,
    start: Float[np.ndarray, "dof"],
    goals: Float[np.ndarray, "g dof"],
    cost: Float[np.ndarray, "g"],
    arm: ArmDescription,
    config: MotionConfig,
    rng: np.random.Generator,
) -> tuple[Trajectory, int] | PlanStage:
    """A free, timed motion to one of the goals and that goal's index, or the stage that failed (FREE or
    TIMING).

    An edge is checked at steps; what grazes an obstacle between them shows in the trajectory, which is
    checked finely. Then the search is repeated with smaller steps.
    """
    failed = PlanStage.FREE
    for refinement in range(config.search.refinements + 1):
        finer = replace(space, step_m=space.step_m / 2**refinement)
        found = free_path(finer, start, goals, cost, config.search, rng)
        if found is None:
            return failed
        trajectory = _timed(found[0], finer, arm, config)
        if trajectory is not None:
            return trajectory, found[1]
        failed = PlanStage.TIMING
    return failed


def _timed(
    path: Float[np.ndarray, "m dof"], space: FreeSpace, arm: ArmDescription, config: MotionConfig
) -> Trajectory | None:
    """The polyline with rounded corners, timed; where that is not free after all, it stops at the corners."""
    if np.all(np.abs(path - path[0]) < 1e-9):
        return Trajectory(np.array([0.0, config.timing.sample_s]), path[[0, 0]], np.zeros((2, path.shape[1])))
    strict = loosened(space, config.search.grazing_m)
    for blends in (corner_blends(path, config.search.blend_rad, space), np.zeros(len(path))):
        parts = [time_path(part, arm, config.timing) for part in rounded_path(path, blends)]
        complete = [p for p in parts if p is not None]
        if len(complete) < len(parts):
            continue
        trajectory = join(complete)
        if not strict.collides(trajectory.qpos).any():
            return trajectory
        if not blends.any():
            break
    return None


def _search(
    space: FreeSpace, start: np.ndarray, goals: np.ndarray, config: SearchConfig, rng: np.random.Generator
) -> Float[np.ndarray, "m dof"] | None:
    # Imported here: OMPL takes a while to load, and only one of the two is ever needed.
    if config.backend == "ompl":
        from torc.motion.ompl_search import ompl_search

        return ompl_search(space, start, goals, config, rng)
    from torc.motion.tree_search import tree_search

    return tree_search(space, start, goals, config, rng)
