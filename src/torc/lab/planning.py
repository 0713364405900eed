"""A motion planner whose plans keep to a laboratory's limits, or are none."""

from dataclasses import dataclass

import numpy as np

from torc.lab.checks import MotionLimits, motion_faults, stretch_for, stretched
from torc.motion.protocol import MotionPlanner, PickRequest
from torc.plugins import warm_up
from torc.records import PickPlan, PlanFailure, PlanStage
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
            slow = stretched(motion, stretch_for(motion, self.limits))
            if faults := motion_faults(slow, motion.qpos[0], 0.0, self.limits, self.robot):
                return PlanFailure(stage, f"it leaves the lab's limits: {faults[0]}", plan.grasps_tried)
        return plan

    def warm_up(self, request: PickRequest) -> None:
        """The other's."""
        warm_up(self.inner, request)
