"""How long the motions of a pick take to plan and how often they are found; and our path search beside OMPL's.

    python -m benchmarks.motion [--scenes 6] [--objects 15]

Processor time after a warm-up. The queries that no straight edge answers are searched again, in turn, by our trees, by
OMPL's RRTConnect around our compiled edge check, and by OMPL as most people use it: a validity check in Python per
state. Every path found is shortened and timed alike.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.validity import evaluate_grasps
from torc.motion import timed_motions
from torc.motion.config import MotionConfig, SearchConfig
from torc.motion.protocol import PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.motion.search import corner_blends, shortcut, tree_search
from torc.motion.space import FreeSpace, MotionQuery
from torc.motion.timing import join, rounded_path, time_path
from torc.records import PickPlan
from torc.robots.description import ArmDescription, RobotDescription
from torc.robots.loading import load_robot
from torc.testing.views import view_of_clutter
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace

STAGES = {
    "straight.candidates": "branches, lines",
    "free.to_pre_grasp": "free motion",
    "straight.timed": "timing of lines",
    "free.to_bin": "transfer",
    "free.home": "home",
}


def main() -> None:
    """Plan, then search again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--objects", type=int, default=15)
    args = parser.parse_args()
    robot, workspace = load_robot(), load_workspace()
    requests = [r for seed in range(args.scenes) for r in _requests(robot, workspace, seed, args.objects)]
    print(f"{len(requests)} graspable objects in {args.scenes} scenes")
    planner = SamplingMotionPlanner(robot, workspace)
    planner.warm_up(requests[0])
    _compare_searches(_plan_all(planner, requests), robot.arm)


def _plan_all(planner: SamplingMotionPlanner, requests: list[PickRequest]) -> list[MotionQuery]:
    """Plans all, prints how long that took, and returns the queries of the path search."""
    searches: list[MotionQuery] = []

    def noted(query: MotionQuery, config: SearchConfig, rng: np.random.Generator) -> np.ndarray | None:
        searches.append(query)
        return tree_search(query, config, rng)

    times: dict[str, list[float]] = defaultdict(list)
    for name, label in STAGES.items():
        _clock(planner, name, label, times)
    timed_motions.tree_search = noted
    motion, stages = [], defaultdict(int)
    for i, request in enumerate(requests):
        start = time.process_time()
        plan = planner.plan_pick(request, np.random.default_rng(i))
        times["plan_pick"].append(time.process_time() - start)
        if isinstance(plan, PickPlan):
            motion.append(
                sum(getattr(plan, s).duration_s for s in ("free", "approach", "lift", "transfer", "home"))
            )
        else:
            stages[plan.stage.value] += 1
    timed_motions.tree_search = tree_search
    print(f"{len(motion)} planned, {np.mean(motion):.1f} s of motion each; failed: {dict(stages)}")
    for label, values in times.items():
        ms = 1e3 * np.array(values)
        print(
            f"  {label:18s} median {np.median(ms):7.1f}  p95 {np.percentile(ms, 95):7.1f}  max {ms.max():7.1f} ms"
        )
    return searches


def _compare_searches(queries: list[MotionQuery], arm: ArmDescription, repeats: int = 3) -> None:
    rivals = {
        "ours": tree_search,
        "OMPL, our edges": lambda *args: ompl_search(*args, compiled_edges),
        "OMPL, states in Python": lambda *args: ompl_search(*args, states_in_python),
    }
    ms: dict[str, list[float]] = defaultdict(list)
    seconds: dict[str, list[float]] = defaultdict(list)
    found: dict[str, int] = defaultdict(int)
    for i, query in enumerate(queries * repeats):
        for name, search in rivals.items():
            rng = np.random.default_rng(i)
            begin = time.process_time()
            path = search(query, SearchConfig(), rng)
            ms[name].append(1e3 * (time.process_time() - begin))
            found[name] += path is not None
            seconds[name].append(np.nan if path is None else _seconds(path, query, arm, rng))
    everywhere = np.all(np.isfinite(list(seconds.values())), axis=0)
    print(f"\n{len(queries)} path searches alone, {repeats} times each")
    for name in rivals:
        print(
            f"  {name:24s} median {np.median(ms[name]):7.1f}  p95 {np.percentile(ms[name], 95):7.1f} ms, found "
            f"{found[name]}, {np.mean(np.array(seconds[name])[everywhere]):.2f} s to the goal and on from it"
        )


def _seconds(path: np.ndarray, query: MotionQuery, arm: ArmDescription, rng: np.random.Generator) -> float:
    """How long the motion takes that is made of a path, what its goal costs later included."""
    config, chosen = MotionConfig(), int(np.argmin(np.linalg.norm(query.goals - path[-1], axis=1)))
    path = shortcut(path, config.search.shortcut_rounds, query.space, rng)
    blends = corner_blends(path, config.search.blend_rad, query.space)
    motion = join([time_path(part, arm, config.timing) for part in rounded_path(path, blends)])
    return motion.duration_s + (0.0 if query.later_s is None else float(query.later_s[chosen]))


Validation = Callable[[ob.SpaceInformation, FreeSpace], None]
"""Tells OMPL how to check."""


def ompl_search(
    query: MotionQuery, config: SearchConfig, rng: np.random.Generator, validate: Validation
) -> Float[np.ndarray, "m dof"] | None:
    """`tree_search` by OMPL's RRTConnect."""
    # OMPL seeds each of its generators from a global one, and warns of every change of its seed.
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(int(rng.integers(1, 2**31 - 1)))
    space, dof = query.space, len(query.start)
    state_space, bounds = ob.RealVectorStateSpace(dof), ob.RealVectorBounds(dof)
    for i in range(dof):
        bounds.setLow(i, float(space.lower[i]))
        bounds.setHigh(i, float(space.upper[i]))
    state_space.setBounds(bounds)
    si = ob.SpaceInformation(state_space)
    validate(si, space)
    si.setup()
    problem, goal = ob.ProblemDefinition(si), ob.GoalStates(si)
    problem.addStartState(_state(state_space, query.start))
    for q in query.goals:
        goal.addState(_state(state_space, q))
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
    if not problem.hasExactSolution():
        return None
    return np.array([_configuration(s, dof) for s in problem.getSolutionPath().getStates()])


def compiled_edges(si: ob.SpaceInformation, space: FreeSpace) -> None:
    """Our compiled checks of configurations and edges."""
    validator = _EdgeValidator(si, space)
    si.setMotionValidator(validator)
    si.setStateValidityChecker(validator.state_free)


def states_in_python(si: ob.SpaceInformation, space: FreeSpace) -> None:
    """A Python callback per state, at the resolution of our edges."""
    dof = len(space.lower)
    si.setStateValidityChecker(lambda state: not space.collides(_configuration(state, dof)[None])[0])
    extent = si.getStateSpace().getMaximumExtent()
    si.setStateValidityCheckingResolution(space.step_m / float(np.max(space.reach)) / extent)


class _EdgeValidator(ob.MotionValidator):
    def __init__(self, si: ob.SpaceInformation, space: FreeSpace) -> None:
        super().__init__(si)
        self.space, self.dof = space, len(space.lower)

    def checkMotion(self, a: ob.State, b: ob.State) -> bool:
        return self.space.edge_free(_configuration(a, self.dof), _configuration(b, self.dof))

    def state_free(self, state: ob.State) -> bool:
        return not self.space.collides(_configuration(state, self.dof)[None])[0]


def _configuration(state: ob.State, dof: int) -> Float[np.ndarray, "dof"]:
    return np.array([state[i] for i in range(dof)])


def _state(state_space: ob.StateSpace, q: np.ndarray) -> ob.State:
    state = state_space.allocState()
    for i, value in enumerate(q):
        state[i] = float(value)
    return state


def _clock(planner: SamplingMotionPlanner, name: str, label: str, times: dict[str, list[float]]) -> None:
    """Time a method, named by the planner's attribute that holds it and its own name."""
    part, method = name.split(".")
    owner = getattr(planner, part)
    call: Callable[..., Any] = getattr(owner, method)

    def timed(*args: Any) -> Any:
        start = time.process_time()
        try:
            return call(*args)
        finally:
            times[label].append(time.process_time() - start)

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
