"""The planner `belief`: makes the removals that most cheaply reveal and free a target that may be in many places."""

from dataclasses import replace

import numpy as np

from torc.records import BeliefEvidence, Decision, Evidence, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.belief.costs import Ways, ways_of
from torc.task_planning.belief.settings import BeliefConfig
from torc.task_planning.belief.target_plans import Search, free_target, may_have_been_seen, search_target
from torc.task_planning.belief.words import access_evidence, access_reason, search_evidence, search_reason
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.relations import find_relations


class BeliefPlanner(TaskPlannerTraits):
    """Keeps particles of where the target may be, and searches for the order of removals that reveals and frees it."""

    name = "belief"

    def __init__(self, config: BeliefConfig | None = None) -> None:
        self.config = BeliefConfig() if config is None else config
        self._fallback = DgSelectPlanner(self.config.fallback)

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick, or None if no visible one is graspable; give up as `GiveUpConfig` says."""
        if not context.graspable_ids:
            return self._by_graph(context, rng, "nothing has a valid grasp")
        ways = ways_of(context, find_relations(context.scene, self.config.fallback.relations))
        if context.scene.target_id is not None:
            return self._take(context, ways, rng)
        return self._find(context, ways, rng)

    def warm_up(self, context: PlanningContext) -> None:
        """Run every compiled kernel once and discard the results."""
        self._fallback.warm_up(context)
        ways = ways_of(context, find_relations(context.scene, self.config.fallback.relations))
        search_target(context, ways, self.config, np.random.default_rng(0))

    def _take(self, context: PlanningContext, ways: dict[int, Ways], rng: np.random.Generator) -> Decision:
        access, target = free_target(context, ways, self.config), context.scene.target_number
        if not np.isfinite(access.picks):
            return self._by_graph(context, rng, "no removal is known to free the target")
        reason = access_reason(access, target, context.called)
        rule = "clear the target" if access.order else "target"
        evidence = Evidence(rule, belief=access_evidence(access))
        return Decision(access.order[0] if access.order else target, reason, evidence=evidence)

    def _find(self, context: PlanningContext, ways: dict[int, Ways], rng: np.random.Generator) -> Decision:
        search = search_target(context, ways, self.config, rng)
        belief = search_evidence(search, context.scene.observation)
        if search.presence < self.config.give_up.below and not may_have_been_seen(context):
            return Decision(
                None, _gives_up(search), give_up=True, evidence=Evidence("give up", belief=belief)
            )
        if search.belief.fitting < self.config.particles.fewest:
            return self._by_graph(context, rng, "too few places fit a hidden target", belief)
        if not search.order:
            return self._by_graph(context, rng, "no removal shows a place where the target may be", belief)
        reason = search_reason(search, context.called)
        return Decision(search.order[0], reason, evidence=Evidence("search", belief=belief))

    def _by_graph(
        self,
        context: PlanningContext,
        rng: np.random.Generator,
        why: str,
        belief: BeliefEvidence | None = None,
    ) -> Decision:
        """Return DG-SELECT's choice, for when the belief says nothing."""
        decision = self._fallback.decide(context, rng)
        notes = {"by_graph_because": why}
        return replace(decision, evidence=replace(decision.evidence, belief=belief, notes=notes))


def _gives_up(search: Search) -> str:
    return (
        f"Give up: the target is not in sight, and only over {search.room:.2%} of the support is there space that "
        f"could still hide it; that it is there has p = {search.presence:.3f}."
    )
