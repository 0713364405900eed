"""Motions: trajectories, the plan of a pick, and a failure to plan."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Trajectory:
    """A timed motion of the arm: times rise from 0; joint positions in radians, velocities in radians per second."""

    times_s: Float[np.ndarray, "t"]
    qpos: Float[np.ndarray, "t dof"]
    qvel: Float[np.ndarray, "t dof"]

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample."""
        return float(self.times_s[-1])


class PlanStage(StrEnum):
    """The motion queries of a pick (paper: A Modular Pipeline, step 4)."""

    GRASP_CHOICE = "grasp choice"
    """There is no valid grasp to plan for."""
    INVERSE_KINEMATICS = "inverse kinematics"
    FREE = "free motion to pre-grasp"
    APPROACH = "approach"
    LIFT = "lift"
    TRANSFER = "transfer to bin"
    TIMING = "time parametrisation"


@dataclass(frozen=True)
class PickPlan:
    """The motions of one pick; each starts where the previous one ends.

    Attributes:
        grasp_index: the grasp's index in the GraspSet.
        width_m: expected distance between the pads when closed on the object.
        free: rest (or wherever the arm is) to pre-grasp, collision-free.
        approach: straight line, pre-grasp to grasp.
        lift: straight line upward, with the object.
        transfer: to above the bin, collision-free with the object's convex hull attached.
        home: from the bin back to rest.
        grasps_tried: grasps for which planning was attempted, this one included.
        is_target: the object is taken for the target. The episode sets it; motion planners need not.
    """

    object_id: int
    grasp_index: int
    T_world_tcp: Float[np.ndarray, "4 4"]
    width_m: float
    free: Trajectory
    approach: Trajectory
    lift: Trajectory
    transfer: Trajectory
    home: Trajectory
    grasps_tried: int
    is_target: bool = False

    @property
    def motions(self) -> tuple[Trajectory, ...]:
        """All five motions, in order."""
        return self.free, self.approach, self.lift, self.transfer, self.home


@dataclass(frozen=True)
class PlanFailure:
    """No plan: the query that failed for the last grasp tried, and the reason in a sentence."""

    stage: PlanStage
    reason: str
    grasps_tried: int
