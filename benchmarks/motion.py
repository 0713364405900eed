"""How long the motions of a pick take to plan, how often they are found, and by which search.

    python benchmarks/motion.py [--scenes 6] [--objects 15]

Wall-clock times after a warm-up. The rival is OMPL as most people use it: a validity check in Python per state.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

from torc.collision.world import build_collision_world
from torc.grasping.planner import GeometricGraspPlanner
from torc.grasping.validity import evaluate_grasps
from torc.motion import queries
from torc.motion.config import MotionConfig
from torc.motion.planner import OmplMotionPlanner, with_backend
from torc.motion.protocol import PickRequest
from torc.motion.space import FreeSpace
from torc.occlusion.volume import OcclusionConfig, empty_volume, update_volume
from torc.perception.privileged import LabelPerception
from torc.records import PickPlan
from torc.robots.description import RobotDescription, load_robot
from torc.scenes.workspace import Workspace
from torc.testing.synthetic import random_clutter, synthetic_observation

STAGES = {
    "_lines": "branches, lines",
    "_free": "free motion",
    "_refined": "pink",
    "_deliver": "transfer, home",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--objects", type=int, default=15)
    args = parser.parse_args()
    robot, workspace = load_robot(), Workspace()
    requests = [r for seed in range(args.scenes) for r in _requests(robot, workspace, seed, args.objects)]
    print(f"{len(requests)} graspable objects in {args.scenes} scenes")
    searches: list[tuple[Any, ...]] = []
    for backend in ("ompl", "numba"):
        planner = OmplMotionPlanner(robot, workspace, with_backend(MotionConfig(), backend))
        planner.plan_pick(requests[0], np.random.default_rng(0))
        _plan_all(planner, requests, backend, searches if backend == "ompl" else [])
    _compare_searches(searches)


def _plan_all(
    planner: OmplMotionPlanner, requests: list[PickRequest], title: str, searches: list[tuple[Any, ...]]
) -> None:
    times: dict[str, list[float]] = defaultdict(list)
    for name, label in STAGES.items():
        _clock(planner, name, label, times)
    search = queries._search
    queries._search = lambda *a: (searches.append(a[:4]), search(*a))[1]  # type: ignore[assignment,func-returns-value]
    found, motion, stages = 0, [], defaultdict(int)
    for i, request in enumerate(requests):
        start = time.perf_counter()
        plan = planner.plan_pick(request, np.random.default_rng(i))
        times["plan_pick"].append(time.perf_counter() - start)
        if isinstance(plan, PickPlan):
            found += 1
            motion.append(
                sum(getattr(plan, s).duration_s for s in ("free", "approach", "lift", "transfer", "home"))
            )
        else:
            stages[plan.stage.value] += 1
    queries._search = search
    print(
        f"\n{title}: {found} of {len(requests)} planned, {np.mean(motion):.1f} s of motion each; failed: {dict(stages)}"
    )
    for label, values in times.items():
        ms = 1e3 * np.array(values)
        print(
            f"  {label:18s} median {np.median(ms):7.1f}  p95 {np.percentile(ms, 95):7.1f}  max {ms.max():7.1f} ms"
        )


def _compare_searches(searches: list[tuple[Any, ...]]) -> None:
    """The queries that no straight edge answers, by each search alone."""
    from torc.motion.ompl_search import ompl_search
    from torc.motion.tree_search import tree_search

    print(f"\n{len(searches)} tree searches alone")
    for name, search in (
        ("ompl, our edges", ompl_search),
        ("numba", tree_search),
        ("ompl, states in Python", rival_search),
    ):
        ms, found = [], 0
        for i, (space, start, goals, config) in enumerate(searches):
            begin = time.perf_counter()
            found += search(space, start, goals, config, np.random.default_rng(i)) is not None
            ms.append(1e3 * (time.perf_counter() - begin))
        print(f"  {name:24s} median {np.median(ms):7.1f}  p95 {np.percentile(ms, 95):7.1f} ms, found {found}")


def rival_search(space: FreeSpace, start: np.ndarray, goals: np.ndarray, config: Any, rng: Any) -> Any:
    """RRTConnect with a Python callback per state, at the resolution of our edges."""
    from ompl import base as ob
    from ompl import geometric as og
    from ompl import util as ou

    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(int(rng.integers(1, 2**31 - 1)))
    dof = len(start)
    state_space = ob.RealVectorStateSpace(dof)
    bounds = ob.RealVectorBounds(dof)
    for i in range(dof):
        bounds.setLow(i, float(space.lower[i]))
        bounds.setHigh(i, float(space.upper[i]))
    state_space.setBounds(bounds)
    si = ob.SpaceInformation(state_space)
    si.setStateValidityChecker(lambda s: not space.collides(np.array([[s[i] for i in range(dof)]]))[0])
    si.setStateValidityCheckingResolution(
        space.step_m / float(np.max(space.reach)) / state_space.getMaximumExtent()
    )
    si.setup()
    problem = ob.ProblemDefinition(si)

    def state(q: np.ndarray) -> Any:
        s = state_space.allocState()
        for i in range(dof):
            s[i] = float(q[i])
        return s

    problem.addStartState(state(start))
    goal = ob.GoalStates(si)
    for q in goals:
        goal.addState(state(q))
    problem.setGoal(goal)
    planner = og.RRTConnect(si)
    planner.setRange(config.range_rad)
    planner.setProblemDefinition(problem)
    planner.setup()
    left = [config.max_iterations]

    def exhausted() -> bool:
        left[0] -= 1
        return left[0] < 0

    planner.solve(ob.PlannerTerminationCondition(exhausted))
    return problem.getSolutionPath() if problem.hasExactSolution() else None


def _clock(planner: OmplMotionPlanner, name: str, label: str, times: dict[str, list[float]]) -> None:
    call: Callable[..., Any] = getattr(planner, name)

    def timed(*args: Any) -> Any:
        start = time.perf_counter()
        try:
            return call(*args)
        finally:
            times[label].append(time.perf_counter() - start)

    setattr(planner, name, timed)


def _requests(robot: RobotDescription, workspace: Workspace, seed: int, objects: int) -> list[PickRequest]:
    shapes = random_clutter(np.random.default_rng(seed), objects)
    scene = LabelPerception().perceive(synthetic_observation(shapes, workspace.camera))
    volume = update_volume(empty_volume(workspace.grid), scene, OcclusionConfig(out_of_view_is_free=True))
    world = build_collision_world(volume, workspace)
    grasps = GeometricGraspPlanner(robot.gripper, workspace.support_z_m).plan(
        scene, volume, np.random.default_rng(seed)
    )
    report = evaluate_grasps(grasps, scene, world, robot)
    return [
        PickRequest(scene, volume, world, grasps, report, k, robot.arm.rest_qpos)
        for k in report.graspable_ids
    ]


if __name__ == "__main__":
    main()
