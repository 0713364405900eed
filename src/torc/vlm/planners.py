"""The planners that ask a model.

VLM-SELECT and VLM+GRASPS let it plan the picks and execute the first one (paper: Approaches 1 and 4); VLM-FIXES-DG lets
it correct the relations that the dependency graph is built from (Approach 3).
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from torc.records import Corrections, Decision, PlanningContext
from torc.records.graph import DependencyEdge
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.dg_select import DgSelectConfig, DgSelectPlanner, decide_by_graph
from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.relations import behind_candidates, find_adjacencies
from torc.vlm.answers import PLAN_SCHEMA, RELATIONS_SCHEMA, Useless, read_corrections, read_first_pick
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


class VlmFixesDgPlanner(TaskPlannerTraits):
    """Gives the model the 'behind' pairs that depth suggests, and decides like DG-SELECT by the corrected pairs."""

    name = "vlm-fixes-dg"
    asks_model = True
    form = Form("vlm-fixes-dg", ("relations",), ("relations",), RELATIONS_SCHEMA)

    def __init__(
        self,
        client: VlmClient | None = None,
        config: DgSelectConfig | None = None,
        asking: Asking | None = None,
    ) -> None:
        self._asker = Asker(client, self.form, asking)
        self.config = DgSelectConfig() if config is None else config

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick; None after three useless answers, or if nothing is graspable.

        The model is not asked if nothing is graspable or no two objects meet. Raises VlmError if its server gives no
        reply.
        """
        candidates = behind_candidates(find_adjacencies(context.scene, self.config.relations))
        if not candidates or not context.graspable_ids:
            return self._by_graph(context, candidates)
        answer, model, nothing = self._asker.consult(
            context,
            {"relations": _as_json(candidates)},
            lambda reply: read_corrections(reply, candidates, context.called),
            rng,
        )
        if isinstance(answer, Useless):
            return nothing
        decision = self._by_graph(context, answer.relations)
        corrections = Corrections(tuple(answer.changes), tuple(answer.refused))
        refused = f", {len(answer.refused)} of its corrections refused" if answer.refused else ""
        changed = f"The VLM {model} changed {len(answer.changes)} of {len(candidates)} relations{refused}."
        return replace(
            decision,
            reason=f"{decision.reason} {changed}",
            attempts=nothing.attempts,
            exchanges=nothing.exchanges,
            pictures=nothing.pictures,
            evidence=replace(decision.evidence, vlm=nothing.evidence.vlm, corrections=corrections),
        )

    def warm_up(self, context: PlanningContext) -> None:
        """Run every compiled kernel once; the model is not asked."""
        DgSelectPlanner(self.config).warm_up(context)

    def _by_graph(self, context: PlanningContext, relations: Sequence[DependencyEdge]) -> Decision:
        graph = build_dependency_graph(context, relations=relations)
        return decide_by_graph(graph, context, self.config.paths)


def _as_json(relations: Sequence[DependencyEdge]) -> str:
    lines = (
        json.dumps({"source": r.source, "relation": r.kind.value, "target": r.target}) for r in relations
    )
    return "[\n  " + ",\n  ".join(lines) + "\n]"
