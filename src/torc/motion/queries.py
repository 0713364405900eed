"""What a search for a free motion is asked."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from torc.motion.space import FreeSpace


@dataclass(frozen=True)
class MotionQuery:
    """From where to where, and what is free on the way.

    Attributes:
        space: what must not be touched.
        start: configuration to start from, radians.
        goals: configurations to end in, any of them.
        later_s: seconds that the choice of each goal costs later; None: all cost the same.
    """

    space: FreeSpace
    start: Float[np.ndarray, "dof"]
    goals: Float[np.ndarray, "g dof"]
    later_s: Float[np.ndarray, "g"] | None = None

    def among(self, index: Int[np.ndarray, "k"]) -> "MotionQuery":
        """The same with only some of the goals."""
        later_s = None if self.later_s is None else self.later_s[index]
        return replace(self, goals=self.goals[index], later_s=later_s)

    def by_time(self) -> Int[np.ndarray, "g"]:
        """Indices of the goals, the soonest first."""
        seconds = self.space.seconds_between(self.start, self.goals)
        return np.argsort(seconds if self.later_s is None else seconds + self.later_s, kind="stable")
