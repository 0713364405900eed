"""The request to a motion planner, and its protocol."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from torc.collision.collision_world import CollisionWorld
from torc.records import (
    GraspReport,
    GraspSet,
    OcclusionVolume,
    PickPlan,
    PlanFailure,
    PlanStage,
    SegmentedScene,
)


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
    qpos_start: Float[np.ndarray, "dof"]


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
    """Raised when a query finds nothing; the planner turns it into a PlanFailure.

    Attributes:
        stage: which query.
        reason: one sentence.
    """

    def __init__(self, stage: PlanStage, reason: str) -> None:
        super().__init__(reason)
        self.stage, self.reason = stage, reason
