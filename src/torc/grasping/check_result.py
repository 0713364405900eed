"""What the hard checks of candidates find: a fault, or which other objects are where."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Int32, UInt8, UInt64

from torc.grasping.config import CheckConfig


class Fault(IntEnum):
    """The first check on its own object or the table that a candidate fails."""

    NONE = 0
    TABLE = 1
    """Part of the gripper is too close to the support, or below it."""
    OWN_IN_FINGERS = 2
    """Points of the object where a finger goes: on the straight approach or while closing."""
    OWN_IN_PALM = 3
    """Points of the object inside the rest of the gripper."""
    TOO_FEW_POINTS = 4
    """Too few seen points of the object between the pads."""


FINGERS, PALM, BETWEEN, NEAR, CORRIDOR = range(5)
"""Where points of other objects are: in the fingers' sweep, in the palm, between the pads, within NEAR_M of the
fingers' sweep, in what the gripper passes on the last CORRIDOR_M of its approach. Each point counts once."""
NEAR_M = 0.012
CORRIDOR_M = 0.10


@dataclass(frozen=True)
class CheckResult:
    """What the checks found.

    Attributes:
        fault: a Fault per candidate.
        blockers: other objects that the gripper touches or has between its pads, bit k for object id k.
        foreign: points of other objects, columns FINGERS .. CORRIDOR; 0 for candidates with a fault, which are
            not looked at further.
    """

    fault: UInt8[np.ndarray, "n"]
    blockers: UInt64[np.ndarray, "n"]
    foreign: Int32[np.ndarray, "n 5"]

    def blocked(self, config: CheckConfig) -> np.ndarray:
        """Whether each candidate touches other objects or would take hold of them."""
        touching = self.foreign[:, FINGERS] + self.foreign[:, PALM] > config.max_foreign_touching
        return touching | (self.foreign[:, BETWEEN] > config.max_foreign_between)
