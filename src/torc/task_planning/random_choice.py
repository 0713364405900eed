"""RANDOM: the target if it can be picked, else any object that can (paper: Approach 0).

The authors' software takes a graspable target at once; that is what their table measures, so it is done here too.
"""

import numpy as np

from torc.records import Decision, PlanningContext
from torc.registry.kinds import TaskPlannerTraits


class RandomPlanner(TaskPlannerTraits):
    """Chooses uniformly among the visible objects with a valid grasp; a graspable target comes first."""

    name = "random"

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The next object to pick, or None if nothing visible has a valid grasp."""
        graspable = graspable_ids(context)
        evidence = {"graspable": list(graspable)}
        target = context.scene.target_id
        if not graspable:
            return Decision(None, "No visible object has a valid grasp.", evidence=evidence)
        if target in graspable:
            return Decision(
                target,
                f"Pick {context.called(target)}: it is the target, and it has a valid grasp.",
                evidence=evidence,
            )
        chosen = int(rng.choice(graspable))
        reason = f"Pick {context.called(chosen)}: drawn at random from the {len(graspable)} objects with a valid grasp."
        return Decision(chosen, reason, evidence=evidence)


def graspable_ids(context: PlanningContext) -> tuple[int, ...]:
    """Ids of the visible objects that have a valid grasp, rising: what a planner may name.

    Grasps that are unlikely to hold (`Pipeline.min_score`) count only while no object has a better one.
    """
    return tuple(k for k in context.report.graspable_ids if k in context.scene.ids)
