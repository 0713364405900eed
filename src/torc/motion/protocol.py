"""The request to a motion planner, its protocol, and how one is asked: what it returns is checked."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from torc.collision.collision_world import CollisionWorld
from torc.errors import PartError
from torc.records import (
    GraspReport,
    GraspSet,
    GraspStatus,
    OcclusionVolume,
    PickPlan,
    PlanFailure,
    PlanStage,
    SegmentedScene,
    Trajectory,
)
from torc.registry.loading import blamed, kind_of_value
from torc.robots.description import Qpos

_HELP = "torc.testing.motion_conformance checks a motion planner against all rules (docs/extending.md)."
MOTIONS = ("free", "approach", "lift", "transfer", "home")
"""The motions of a plan, in order."""
_JOINED_RAD = 1e-3


@dataclass(frozen=True)
class PickRequest:
    """Everything needed to plan the motions of one pick.

    Attributes:
        scene: the perceived scene; the object's points become its collision volume once it is held.
        volume: the occlusion volume.
        world: obstacles, built from that volume.
        grasps: candidate grasps of all objects.
        report: which of them are valid, with an inverse-kinematics solution each.
        object_id: the object to pick.
        qpos_start: where the arm is, radians.
    """

    scene: SegmentedScene
    volume: OcclusionVolume
    world: CollisionWorld
    grasps: GraspSet
    report: GraspReport
    object_id: int
    qpos_start: Qpos


class MotionPlanner(Protocol):
    """Plans the motions of a pick.

    A planner with numba kernels may have a second method, `warm_up(request)`; see
    `torc.registry.kinds.MotionPlannerTraits`.
    """

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """Return motions for the best valid grasp of the object for which all of them exist.

        Equal requests and generator states give equal answers.
        """
        ...


class NoMotionError(Exception):
    """Raised when a query (`stage`) finds nothing, for a reason; the planner turns it into a PlanFailure."""

    def __init__(self, stage: PlanStage, reason: str) -> None:
        super().__init__(reason)
        self.stage, self.reason = stage, reason


def ask_motion_planner(
    planner: MotionPlanner, request: PickRequest, rng: np.random.Generator
) -> PickPlan | PlanFailure:
    """Return the motions of a pick. Raises PartError if the planner crashed or gave no plan that could be followed."""
    what = f"Motion planner {type(planner).__name__}"
    with blamed(what, PartError, _HELP):
        plan: Any = planner.plan_pick(request, rng)
    for fault in plan_faults(plan, request):
        raise PartError(f"{what} gave no valid plan: {fault}. {_HELP}")
    return plan


def plan_faults(plan: Any, request: PickRequest) -> Iterator[str]:
    """Yield the reasons why something is not a valid plan for a request; collisions are not checked."""
    if isinstance(plan, PlanFailure):
        return
    if not isinstance(plan, PickPlan):
        yield f"plan_pick() returned {kind_of_value(plan)}, not a torc.records.PickPlan or PlanFailure"
        return
    if plan.object_id != request.object_id:
        yield f"it is for object {plan.object_id}, but object {request.object_id} was asked for"
        return
    g = plan.grasp_index
    if not 0 <= g < len(request.grasps) or request.grasps.object_ids[g] != plan.object_id:
        yield f"grasp_index {g} is no grasp of object {plan.object_id}"
    elif request.report.status[g] != GraspStatus.VALID:
        yield f"grasp {g} is not valid"
    q = np.asarray(request.qpos_start, dtype=float)
    for name in MOTIONS:
        motion = getattr(plan, name)
        faults = list(_trajectory_faults(motion, len(q)))
        if faults:
            yield f"its motion '{name}' {faults[0]}"
            return
        if np.abs(motion.qpos[0] - q).max() > _JOINED_RAD:
            yield f"its motion '{name}' does not begin where the arm is then"
        q = motion.qpos[-1]


def _trajectory_faults(motion: Any, dof: int) -> Iterator[str]:
    if not isinstance(motion, Trajectory):
        yield f"is {kind_of_value(motion)}, not a torc.records.Trajectory"
        return
    n = len(motion.times_s)
    if n < 1 or motion.qpos.shape != (n, dof) or motion.qvel.shape != (n, dof):
        yield f"must have times_s of shape (t,), qpos and qvel of shape (t, {dof})"
    elif not (np.isfinite(motion.qpos).all() and np.isfinite(motion.qvel).all()):
        yield "must be finite"
    elif motion.times_s[0] != 0 or (np.diff(motion.times_s) <= 0).any():
        yield "must have times that begin with 0 and rise"
