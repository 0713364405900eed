"""RANDOM: pick the target if it is graspable, else any graspable object (paper: Approach 0).

The authors' software takes a graspable target at once; their table measures that, so it is done here too.
"""

import numpy as np

from torc.records import Decision, Evidence, PlanningContext
from torc.registry.kinds import TaskPlannerTraits


class RandomPlanner(TaskPlannerTraits):
    """Chooses uniformly among the visible objects with a valid grasp; a graspable target comes first."""

    name = "random"
    reads_picture = False

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick, or None if nothing visible has a valid grasp."""
        graspable, target = context.graspable_ids, context.scene.target_id
        if not graspable:
            return Decision(None, "No visible object has a valid grasp.")
        if target in graspable:
            reason = f"Pick {context.called(target)}: it is the target, and it has a valid grasp."
            return Decision(target, reason, evidence=Evidence("target"))
        chosen = int(rng.choice(graspable))
        reason = f"Pick {context.called(chosen)}: drawn at random from the {len(graspable)} objects with a valid grasp."
        return Decision(chosen, reason, evidence=Evidence("random"))
