"""How long the motions of a pick take to plan, how often they are found, and by which search.

    python -m benchmarks.motion [--scenes 6] [--objects 15]

Wall-clock times after a warm-up. The rival is OMPL as most people use it: a validity check in Python per state.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from torc.grasping.planner import GeometricGraspPlanner
from torc.grasping.validity import evaluate_grasps
from torc.motion import queries
from torc.motion.config import MotionConfig, SearchConfig
from torc.motion.planner import OmplMotionPlanner, with_backend
from torc.motion.protocol import PickRequest
from torc.motion.queries import MotionQuery, PathSearch
from torc.motion.space import FreeSpace
from torc.records import PickPlan
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.scenes.workspace import Workspace
from torc.testing.views import view_of_clutter

Search = tuple[MotionQuery, SearchConfig]

STAGES = {
    "straight.candidates": "branches, lines",
    "free.to_pre_grasp": "free motion",
    "straight.timed": "pink, timing",
    "free.to_bin": "transfer",
    "free.home": "home",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--objects", type=int, default=15)
    args = parser.parse_args()
    robot, workspace = load_robot(), Workspace()
    requests = [r for seed in range(args.scenes) for r in _requests(robot, workspace, seed, args.objects)]
    print(f"{len(requests)} graspable objects in {args.scenes} scenes")
    searches: list[Search] = []
    for backend in ("ompl", "numba"):
        planner = OmplMotionPlanner(robot, workspace, with_backend(MotionConfig(), backend))
        planner.plan_pick(requests[0], np.random.default_rng(0))
        _plan_all(planner, requests, backend, searches if backend == "ompl" else [])
    _compare_searches(searches)


def _plan_all(
    planner: OmplMotionPlanner, requests: list[PickRequest], title: str, searches: list[Search]
) -> None:
    times: dict[str, list[float]] = defaultdict(list)
    for name, label in STAGES.items():
        _clock(planner, name, label, times)
    choose = queries.path_search
    queries.path_search = lambda config: _noting(choose(config), searches)
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
    queries.path_search = choose
    print(
        f"\n{title}: {found} of {len(requests)} planned, {np.mean(motion):.1f} s of motion each; failed: {dict(stages)}"
    )
    for label, values in times.items():
        ms = 1e3 * np.array(values)
        print(
            f"  {label:18s} median {np.median(ms):7.1f}  p95 {np.percentile(ms, 95):7.1f}  max {ms.max():7.1f} ms"
        )


def _noting(search: PathSearch, searches: list[Search]) -> PathSearch:
    """The search, its queries added to a list."""

    def noted(query: MotionQuery, config: SearchConfig, rng: np.random.Generator) -> np.ndarray | None:
        searches.append((query, config))
        return search(query, config, rng)

    return noted


def _compare_searches(searches: list[Search]) -> None:
    """The queries that no straight edge answers, by each search alone."""
    from torc.motion.ompl_search import ompl_search
    from torc.motion.tree_search import tree_search

    print(f"\n{len(searches)} tree searches alone")
    rivals: tuple[tuple[str, PathSearch], ...] = (
        ("ompl, our edges", ompl_search),
        ("numba", tree_search),
        ("ompl, states in Python", partial(ompl_search, validate=states_in_python)),
    )
    for name, search in rivals:
        ms, found = [], 0
        for i, (query, config) in enumerate(searches):
            begin = time.perf_counter()
            found += search(query, config, np.random.default_rng(i)) is not None
            ms.append(1e3 * (time.perf_counter() - begin))
        print(f"  {name:24s} median {np.median(ms):7.1f}  p95 {np.percentile(ms, 95):7.1f} ms, found {found}")


def states_in_python(si: Any, space: FreeSpace) -> None:
    """Tells OMPL to check by a Python callback per state, at the resolution of our edges."""
    from torc.motion.ompl_search import configuration

    dof = len(space.lower)
    si.setStateValidityChecker(lambda state: not space.collides(configuration(state, dof)[None])[0])
    extent = si.getStateSpace().getMaximumExtent()
    si.setStateValidityCheckingResolution(space.step_m / float(np.max(space.reach)) / extent)


def _clock(planner: OmplMotionPlanner, name: str, label: str, times: dict[str, list[float]]) -> None:
    """Time a method, named by the planner's attribute that holds it and its own name."""
    part, method = name.split(".")
    owner = getattr(planner, part)
    call: Callable[..., Any] = getattr(owner, method)

    def timed(*args: Any) -> Any:
        start = time.perf_counter()
        try:
            return call(*args)
        finally:
            times[label].append(time.perf_counter() - start)

    setattr(owner, method, timed)


def _requests(robot: RobotDescription, workspace: Workspace, seed: int, objects: int) -> list[PickRequest]:
    view = view_of_clutter(seed, objects, workspace)
    grasps = GeometricGraspPlanner(robot.gripper, workspace.support_z_m).plan(
        view.scene, view.volume, np.random.default_rng(seed)
    )
    report = evaluate_grasps(grasps, view.scene, view.world, robot)
    return [
        PickRequest(view.scene, view.volume, view.world, grasps, report, k, robot.arm.rest_qpos)
        for k in report.graspable_ids
    ]


if __name__ == "__main__":
    main()
