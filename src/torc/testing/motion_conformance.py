"""Check what every motion planner must do: `check_motion_planner(MyPlanner)`.

The class is made as `torc run --motion` makes it: with `robot` and `workspace`, if it has parameters of these names. A
NonConformanceError lists what was broken. Collisions are not checked here; `benchmarks/motion_safety.py` does that.
"""

import pickle
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from torc.episode.steps import pick_request
from torc.motion.protocol import MotionPlanner, PickRequest, plan_faults
from torc.perception.protocol import Wanted
from torc.pipeline.building import System, build_system
from torc.registry.context import BuildContext
from torc.registry.kinds import MOTION_PLANNERS
from torc.specs.conditions import Conditions
from torc.testing.conformance import called_twice, made, require, trait_faults
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_capture

_SHAPES = (
    box(0, 0.62, 0.0, (0.05, 0.05, 0.10)),
    box(1, 0.62, -0.2, (0.05, 0.05, 0.12)),
    box(2, 0.74, -0.1, (0.06, 0.06, 0.20)),
)


@cache
def _system() -> System:
    return build_system(Conditions())


@cache
def requests() -> tuple[PickRequest, ...]:
    """Return a request per object that the shipped robot can grasp, in a small scene."""
    system = _system()
    capture = synthetic_capture(_SHAPES, system.workspace.camera)
    look = system.pipeline.look(
        replace(capture, observation=replace(capture.observation, qpos=system.robot.arm.rest_qpos)),
        wanted=Wanted("the box"),
    )
    return tuple(pick_request(look, k) for k in look.context.report.graspable_ids)


def check_motion_planner(make: Callable[..., MotionPlanner]) -> None:
    """Plan all requests with fresh planners. Raises NonConformanceError with everything that was broken."""
    part = made(make, BuildContext(robot=_system().robot, workspace=_system().workspace))
    broken = [f"object {r.object_id}: {text}" for r in requests() for text in _violations(make, r)]
    require("motion planner", [*trait_faults(MOTION_PLANNERS, part), *broken])


def _violations(make: Callable[..., MotionPlanner], request: PickRequest) -> list[str]:
    context = BuildContext(robot=_system().robot, workspace=_system().workspace)
    plans, found = called_twice(
        lambda: made(make, context).plan_pick(request, np.random.default_rng(0)), request, "the request"
    )
    found += [fault for plan in plans[:1] for fault in plan_faults(plan, request)]
    if not found and pickle.dumps(plans[0]) != pickle.dumps(plans[1]):
        found.append("the same rng gave two different plans")
    return found
