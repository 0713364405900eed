"""Plan for a real arm: keep to its limits, be careful if it feels no contact, and show where plans lead."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from torc.geometry.transforms import invert, transform_points
from torc.motion.protocol import MotionPlanner, PickRequest
from torc.pipeline.building import System, build_system
from torc.records import PickPlan, PlanFailure, PlanStage, Trajectory
from torc.registry.kinds import MOTION_PLANNERS
from torc.robots.description import RobotDescription
from torc.robots.execution import ExecutionConfig
from torc.robots.kinematics import tool0_poses
from torc_lab.checks import MotionLimits, motion_faults, outside_box, stretch_for, stretched, thinned

_STAGES = (PlanStage.FREE, PlanStage.APPROACH, PlanStage.LIFT, PlanStage.TRANSFER, PlanStage.TRANSFER)
MOTIONS = ("free", "approach", "lift", "transfer", "home")
_POINTS = 40
"""Points of a motion's path: enough for a curve on a screen."""
_APPROACH = "motion.cartesian.approach_speed_m_s"
_MARGINS = tuple(f"grasps.checks.{name}_margin_m" for name in ("finger", "palm", "table", "tip"))
WITHOUT_GUARD: Mapping[str, float] = {_APPROACH: 0.05, **dict.fromkeys(_MARGINS, 0.008)}
"""Settings of planning for an arm that feels no contact. With a guard approaches are three times as fast, and objects
keep 3 mm; a camera's pose that is off by 3 mm, which is as much as a calibration may be, touches them then."""
_OWNERS = {"motion": "sampling", "grasps": "geometric"}
"""The planners that have these settings."""
Ways = Mapping[str, tuple[tuple[float, float, float], ...]]


@dataclass(frozen=True)
class LimitedMotionPlanner:
    """Wraps a planner, and rejects plans that the supervisor would refuse halfway through a pick."""

    inner: MotionPlanner
    robot: RobotDescription
    limits: MotionLimits

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """Return the inner planner's plan, or a PlanFailure if the plan leaves the limits."""
        plan = self.inner.plan_pick(request, rng)
        if isinstance(plan, PlanFailure):
            return plan
        for stage, fault in self._faults(request, plan):
            return PlanFailure(stage, f"it leaves the lab's limits: {fault}", plan.grasps_tried)
        return plan

    def _faults(self, request: PickRequest, plan: PickPlan) -> Iterator[tuple[PlanStage, str]]:
        """Yield where the arm leaves its limits, or the held object's visible points leave the workspace."""
        for stage, motion in zip(_STAGES, plan.motions, strict=True):
            slow = stretched(motion, stretch_for(motion, self.limits, self.robot))
            for fault in motion_faults(slow, motion.qpos[0], 0.0, self.limits, self.robot):
                yield stage, fault
        points = request.scene.object(plan.object_id).points
        in_tcp = transform_points(invert(plan.T_world_tcp), points.astype(float))
        T_tool0_tcp = self.robot.gripper.T_tool0_tcp(plan.width_m)
        for motion in (plan.lift, plan.transfer):
            tcp = tool0_poses(self.robot.arm, motion.qpos) @ T_tool0_tcp
            places = np.einsum("nij,kj->nki", tcp[:, :3, :3], in_tcp) + tcp[:, None, :3, 3]
            for fault in outside_box(places, motion.times_s, self.limits, "the object in the hand"):
                yield PlanStage.TRANSFER, fault

    def warm_up(self, request: PickRequest) -> None:
        """Warm up the inner planner."""
        MOTION_PLANNERS.traits(self.inner).warm_up(request)


def guarded(system: System, execution: ExecutionConfig) -> tuple[System, str]:
    """Return the system, made careful if its robot feels no contact, and a text for the user about that.

    Without a guard it is built again with the settings `WITHOUT_GUARD`, except for those that the conditions set and
    those that its planners do not have.
    """
    if execution.approach_guard is not None:
        force_n = execution.approach_guard.max_force_n
        return system, f"The robot stops at a contact of {force_n:g} N while it approaches."
    spec = system.conditions
    have = {stage for stage, owner in _OWNERS.items() if getattr(spec, stage) == owner}
    own = {k: v for k, v in WITHOUT_GUARD.items() if k.partition(".")[0] in have}
    settings: dict[str, Any] = {**own, **spec.settings}
    text = ["The robot feels no contact, and nothing but you stops it when it touches something."]
    for name, words, what in (
        (_APPROACH, "Approaches are slow: {:g} m/s.", "approaches"),
        (_MARGINS[0], "Grasps keep {:g} m from other objects.", "grasps"),
    ):
        unknown = f"How careful {what} are is their planner's own matter."
        text.append(words.format(settings[name]) if settings.get(name) is not None else unknown)
    return build_system(replace(spec, settings=settings), system.workspace, system.robot), " ".join(text)


def tcp_ways(robot: RobotDescription, plan: PickPlan) -> Ways:
    """Return the TCP's positions along each motion, world frame, metres, rounded to millimetres."""
    return {name: _places(robot, getattr(plan, name)) for name in MOTIONS}


def ways_text(
    ways: Ways, plan: PickPlan, robot: RobotDescription, limits: MotionLimits, support_z_m: float
) -> str:
    """Return each motion in words: the TCP's path length, the time at the lab's speed, and the lowest height."""
    parts = []
    for name, places in ways.items():
        motion, at = getattr(plan, name), np.array(places)
        far = float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        seconds = motion.duration_s * stretch_for(motion, limits, robot)
        low = 100 * (float(at[:, 2].min()) - support_z_m)
        parts.append(f"{name} {far:.2f} m in {seconds:.0f} s, lowest at {low:+.0f} cm")
    return f"The fingertips' way, heights from the table: {'; '.join(parts)}."


def _places(robot: RobotDescription, motion: Trajectory) -> tuple[tuple[float, float, float], ...]:
    tcp = tool0_poses(robot.arm, thinned(motion, _POINTS).qpos) @ robot.gripper.T_tool0_tcp(0.0)
    return tuple((x, y, z) for x, y, z in np.round(tcp[:, :3, 3], 3).tolist())
