"""A motion planner whose plans keep to a laboratory's limits, or are none."""

from dataclasses import dataclass, replace

import numpy as np

from torc.lab.checks import MotionLimits, motion_faults, stretch_for, stretched
from torc.motion.protocol import MotionPlanner, PickRequest
from torc.plugins import warm_up
from torc.records import PickPlan, PlanFailure, PlanStage, Trajectory
from torc.robots.description import RobotDescription

_STAGES = (PlanStage.FREE, PlanStage.APPROACH, PlanStage.LIFT, PlanStage.TRANSFER, PlanStage.TRANSFER)


@dataclass(frozen=True)
class LimitedMotionPlanner:
    """Another planner's plans, less those that the supervisor would refuse halfway through a pick."""

    inner: MotionPlanner
    robot: RobotDescription
    limits: MotionLimits

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """As the other's; a plan that leaves the limits is none."""
        plan = self.inner.plan_pick(request, rng)
        if isinstance(plan, PlanFailure):
            return plan
        for stage, motion in zip(_STAGES, plan.motions, strict=True):
            if faults := self._faults(motion):
                return PlanFailure(stage, f"it leaves the lab's limits: {faults[0]}", plan.grasps_tried)
        turns = tuple(turn for turn in plan.turns if not self._faults(turn))
        return plan if len(turns) == len(plan.turns) else replace(plan, turns=turns)

    def _faults(self, motion: Trajectory) -> list[str]:
        slow = stretched(motion, stretch_for(motion, self.limits))
        return motion_faults(slow, motion.qpos[0], 0.0, self.limits, self.robot)

    def warm_up(self, request: PickRequest) -> None:
        """The other's."""
        warm_up(self.inner, request)
