"""A motion planner of one's own: the shipped one's motions, at a share of their speed.

torc run --motion examples/slow_motion.py:SlowMotion --motion.speed 0.25
"""

from dataclasses import replace

import numpy as np

from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.protocols import PickPlan, PickRequest, PlanFailure, RobotDescription, Trajectory, Workspace


class SlowMotion:
    """Slower, along the same paths."""

    def __init__(self, robot: RobotDescription, workspace: Workspace, speed: float = 0.5) -> None:
        self.shipped, self.speed = SamplingMotionPlanner(robot, workspace), speed

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """The shipped planner's answer, slowed down."""
        plan = self.shipped.plan_pick(request, rng)
        if isinstance(plan, PlanFailure):
            return plan
        names = ("free", "approach", "lift", "transfer", "home")
        return replace(plan, **{name: self._slower(getattr(plan, name)) for name in names})

    def warm_up(self, request: PickRequest) -> None:
        """So that compiling kernels is no planning time."""
        self.shipped.warm_up(request)

    def _slower(self, motion: Trajectory) -> Trajectory:
        return replace(motion, times_s=motion.times_s / self.speed, qvel=motion.qvel * self.speed)
