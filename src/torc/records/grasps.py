"""Grasps and what is known about each."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int16, Int32, UInt8, UInt64


class GraspStatus(IntEnum):
    """Why a grasp is valid or not: the first check, in this order, that it fails (paper: Grasping)."""

    VALID = 0
    UNREACHABLE = 1
    """No inverse-kinematics solution within the joint limits."""
    BLOCKED = 2
    """The arm or gripper at the grasp touches surface or occlusion voxels of other objects."""
    HITS_STATIC = 3
    """Every inverse-kinematics solution touches the table, another fixed part of the workspace, or the robot itself."""
    SEVERAL_OBJECTS = 4
    """Not exactly one object between the fingers."""
    FINGERS_IN_OBJECT = 5
    """A finger intersects surface points of the object to be grasped."""
    NO_MOTION = 6
    """No motion was found for it, or for one like it, in an earlier pick since which nothing has changed."""
    UNLIKELY = 7
    """Too unlikely to be worth a pick while other grasps are valid (`Pipeline.min_score`), or while clearing one object
    more is the better bet (torc.pipeline.better_bet)."""
    NO_LINE = 8
    """The arm has no straight approach to it from a free pre-grasp, or no straight lift."""


@dataclass(frozen=True)
class GraspSet:
    """Candidate grasps for all visible objects, the best of each object first.

    The grasp frame is the tool centre point (TCP): origin midway between the distal ends of the fingertips at
    the grasping width, x the closing direction, z the approach direction (out of the gripper).

    Attributes:
        Ts_world_tcp: grasp poses.
        widths_m: distance between the pads when they touch the object.
        scores: probability that the object is delivered to the bin, 0..1.
        contacts: estimated contact point of each finger, world frame, at -x and +x.
        generators: index into generator_names, which generator proposed it.
    """

    Ts_world_tcp: Float[np.ndarray, "n 4 4"]
    widths_m: Float[np.ndarray, "n"]
    scores: Float[np.ndarray, "n"]
    object_ids: Int16[np.ndarray, "n"]
    contacts: Float[np.ndarray, "n 2 3"]
    generators: UInt8[np.ndarray, "n"]
    generator_names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.scores)

    def of(self, object_id: int) -> np.ndarray:
        """Return indices of this object's grasps, by falling score."""
        index = np.flatnonzero(self.object_ids == object_id)
        return index[np.argsort(-self.scores[index], kind="stable")]


@dataclass(frozen=True)
class GraspReport:
    """How each grasp is reached or why not, and which objects block which (paper: Grasping).

    Attributes:
        status: a GraspStatus per grasp.
        qpos: inverse-kinematics solution of the arm per grasp, radians; NaN where there is none.
        blockers: per grasp the other objects that the arm or gripper touches, bit k for object id k.
        object_ids: ids of all visible objects, rising.
        blocking: blocking[i, j] = how many grasps of object_ids[i] are blocked by object_ids[j]; a grasp may count for
            several j.
        blocked_total: per object, how many of its grasps are blocked by at least one other object.
        valid_total: per object, how many grasps are VALID: those held back as UNLIKELY or NO_MOTION do not count. Of
            the VALID ones, only the best have been found to have straight ways, as many as the motion planner tries.
    """

    status: UInt8[np.ndarray, "n"]
    qpos: Float[np.ndarray, "n dof"]
    blockers: UInt64[np.ndarray, "n"]
    object_ids: tuple[int, ...]
    blocking: Int32[np.ndarray, "k k"]
    blocked_total: Int32[np.ndarray, "k"]
    valid_total: Int32[np.ndarray, "k"]

    def has_valid_grasp(self, object_id: int) -> bool:
        """True if the object is graspable now; False for an object that is not in the scene."""
        return object_id in self.object_ids and self.valid_total[self.object_ids.index(object_id)] > 0

    @property
    def graspable_ids(self) -> tuple[int, ...]:
        """Ids of the objects with at least one valid grasp, rising."""
        return tuple(k for k, n in zip(self.object_ids, self.valid_total) if n > 0)
