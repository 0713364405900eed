"""A task planner of one's own: a class with a name and one method.

cd examples
torc run --planner nearest_planner:Nearest
"""

import numpy as np

from torc import Decision, PlanningContext


class Nearest:
    """Always picks the graspable object nearest to the robot."""

    name = "nearest"

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The object whose visible points are nearest, of those with a valid grasp."""
        graspable = context.graspable_ids
        if not graspable:
            return Decision(None, "nothing is graspable")
        nearest = min(graspable, key=lambda k: context.scene.object(k).points[:, 0].mean())
        return Decision(nearest, "it is the nearest")
