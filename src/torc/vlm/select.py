"""VLM-SELECT and VLM+GRASPS: the model plans the picks, and the first one is executed (paper: Approaches 1 and 4)."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from torc.records import Decision, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.vlm.answers import PLAN_SCHEMA, Useless, read_first_pick
from torc.vlm.asker import Asker, Form
from torc.vlm.config import Asking
from torc.vlm.protocol import Reply, VlmClient
from torc.vlm.question_facts import grasp_facts


class VlmSelectPlanner(TaskPlannerTraits):
    """Shows the model the marked image without grasp information; asks again if its choice is not graspable."""

    name = "vlm-select"
    asks_model = True
    form = Form("vlm-select", ("target",), (), PLAN_SCHEMA)

    def __init__(self, client: VlmClient | None = None, asking: Asking | None = None) -> None:
        self._asker = Asker(client, self.form, asking)

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick; None after three useless answers, or, without asking, if nothing is
        graspable.

        Raises:
            VlmError: the model's server gives no reply.
        """
        graspable = context.graspable_ids
        if not graspable:
            return Decision(None, "No visible object has a valid grasp, so the VLM was not asked.")

        def read(reply: Reply) -> int | Useless:
            chosen = read_first_pick(reply, context.scene.ids)
            if isinstance(chosen, int) and chosen not in graspable:
                return Useless(f"It names object {context.called(chosen)}, which has no valid grasp.")
            return chosen

        answer, model, nothing = self._asker.consult(context, self.facts(context), read, rng)
        if isinstance(answer, Useless):
            return nothing
        plan = f"the plan of the VLM {model} begins with it (answer {nothing.attempts} of at most 3)"
        return replace(nothing, object_id=answer, reason=f"Pick {context.called(answer)}: {plan}.")

    def facts(self, context: PlanningContext) -> Mapping[str, str]:
        """Return what the prompt says beyond the target."""
        return {}


class VlmGraspsPlanner(VlmSelectPlanner):
    """Shows the marked image and says what is graspable and what blocks what."""

    name = "vlm-grasps"
    form = Form("vlm-grasps", ("target", "facts"), ("facts",), PLAN_SCHEMA)

    def facts(self, context: PlanningContext) -> Mapping[str, str]:
        """Return a sentence per graspable object, and per pair of a blocked object and its blocker.

        The third version of the questions adds numbers of grasps.
        """
        return {"facts": "\n".join(grasp_facts(context, counted=self._asker.asking.questions >= 3))}
