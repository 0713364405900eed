"""A motion planner whose plans keep to a laboratory's limits, or are none."""

from dataclasses import dataclass

import numpy as np

from torc.geometry.transforms import invert, transform_points
from torc.motion.protocol import MotionPlanner, PickRequest
from torc.records import PickPlan, PlanFailure, PlanStage
from torc.registry.kinds import MOTION_PLANNERS
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc_lab.checks import MotionLimits, motion_faults, outside_box, stretch_for, stretched

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
            slow = stretched(motion, stretch_for(motion, self.limits, self.robot))
            if faults := motion_faults(slow, motion.qpos[0], 0.0, self.limits, self.robot):
                return PlanFailure(stage, f"it leaves the lab's limits: {faults[0]}", plan.grasps_tried)
        if faults := self._held_faults(request, plan):
            return PlanFailure(
                PlanStage.TRANSFER, f"it leaves the lab's limits: {faults[0]}", plan.grasps_tried
            )
        return plan

    def _held_faults(self, request: PickRequest, plan: PickPlan) -> list[str]:
        """Where the object in the hand leaves the workspace, by its visible points."""
        points = request.scene.object(plan.object_id).points
        in_tcp = transform_points(invert(plan.T_world_tcp), points.astype(float))
        T_tool0_tcp = self.robot.gripper.T_tool0_tcp(plan.width_m)
        for motion in (plan.lift, plan.transfer):
            tcp = tool0_poses(self.robot.arm, motion.qpos) @ T_tool0_tcp
            places = np.einsum("nij,kj->nki", tcp[:, :3, :3], in_tcp) + tcp[:, None, :3, 3]
            if faults := outside_box(places, motion.times_s, self.limits, "the object in the hand"):
                return faults
        return []

    def warm_up(self, request: PickRequest) -> None:
        """The other's."""
        MOTION_PLANNERS.traits(self.inner).warm_up(request)
