"""Every motion of many picks on the shipped problems against the independent checker (full geometry, not spheres).

    python -m benchmarks.motion_safety --picks 200

For each problem, object after object is planned for and taken away, so that scenes of all stages are met. Checked
are joint limits and speeds, continuity, straightness of the Cartesian parts, and collisions (see
tests.helpers.motion_checker).
"""

import itertools
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import tyro

from tests.helpers.motion_checker import PlanChecker
from torc.episode.steps import pick_request
from torc.motion.protocol import PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.pipeline.building import build_pipeline
from torc.pipeline.look import Look
from torc.pipeline.state import stage_rng
from torc.problems.problem import Problem, load_problem
from torc.problems.sets import problem_names
from torc.records import PickPlan
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.sim.robot import SimulatedRobot
from torc.sim.simulated_world import build_world
from torc.specs.conditions import Conditions
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace


@dataclass(frozen=True)
class Args:
    """Plan picks until enough are planned, and check each."""

    picks: int = 200
    """How many plans to check."""


def main() -> None:
    """Run and print the table."""
    args = tyro.cli(Args)
    robot, workspace = load_robot(), load_workspace()
    planner, checker = SamplingMotionPlanner(robot, workspace), PlanChecker(robot, workspace)
    seconds, failures, faulty, checked = [], Counter(), [], 0
    for name, seed, request in itertools.islice(all_requests(robot, workspace), args.picks):
        start = time.perf_counter()
        plan = planner.plan_pick(request, stage_rng(seed, 0, "motion"))
        seconds.append(time.perf_counter() - start)
        if not isinstance(plan, PickPlan):
            failures[str(plan.stage)] += 1
            continue
        checked += 1
        faults = checker.faults(plan, request)
        if faults:
            faulty.append(f"{name}, object {request.object_id}: " + "; ".join(faults))
    median, p95 = np.percentile(seconds, [50, 95])
    print(f"plans checked {checked}, with faults {len(faulty)}")
    print(f"not planned {sum(failures.values())} of {len(seconds)}: {dict(failures)}")
    print(f"planning time: median {median:.3f} s, p95 {p95:.3f} s (budget .150 / .500)")
    print("\n".join(faulty))


def all_requests(robot: RobotDescription, workspace: Workspace) -> Iterator[tuple[str, int, PickRequest]]:
    """Requests from all problems, seed after seed: (problem, seed, request)."""
    for seed in itertools.count():
        for name in problem_names("torc40"):
            for request in requests(load_problem(name), robot, workspace, seed):
                yield name, seed, request


def requests(
    problem: Problem, robot: RobotDescription, workspace: Workspace, seed: int
) -> Iterator[PickRequest]:
    """A request for each graspable object of the scene, then of the scene without one of them, and so on."""
    rng = np.random.default_rng(seed)
    pipeline = build_pipeline(Conditions(), robot, workspace)
    while len(problem.objects) > 1:
        with SimulatedRobot(build_world(problem, robot, workspace)) as simulated:
            capture = simulated.capture()
        look: Look = pipeline.look(capture, seed=seed)
        graspable = look.context.report.graspable_ids
        for object_id in graspable:
            yield pick_request(look, object_id)
        removable = [k for k in graspable if k != 0]
        if not removable:
            return
        gone = problem.ordered()[int(rng.choice(removable))].name
        problem = replace(problem, objects=tuple(o for o in problem.objects if o.name != gone))


if __name__ == "__main__":
    main()
