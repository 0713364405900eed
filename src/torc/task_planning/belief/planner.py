"""The planner `belief`: removes what most cheaply shows where a hidden target is, by a belief over its pose."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from torc.records import TARGET_ID, Decision, PlanningContext
from torc.task_planning.belief.bodies import bodies_of
from torc.task_planning.belief.costs import Ways, removal_costs, target_costs, ways_of
from torc.task_planning.belief.hiding import Belief, believe
from torc.task_planning.belief.particles import propose
from torc.task_planning.belief.search import (
    Places,
    Plan,
    SearchPrices,
    order_removals,
    places_of,
    plan_search,
    sets_up_to,
)
from torc.task_planning.belief.settings import BeliefConfig
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.graph import DependencyEdge
from torc.task_planning.random_choice import graspable_ids
from torc.task_planning.relations import find_relations

_WORTH = 0.01


class BeliefPlanner:
    """Keeps particles of where the target may be, and searches for the order of removals that shows and frees it."""

    name = "belief"

    def __init__(self, config: BeliefConfig | None = None) -> None:
        self.config = BeliefConfig() if config is None else config
        self._fallback = DgSelectPlanner(self.config.fallback)

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The next object to pick, or None if nothing visible has a valid grasp; gives up as `GiveUpConfig` says."""
        if not graspable_ids(context):
            return self._fallback.decide(context, rng)
        relations = find_relations(context.scene, self.config.fallback.relations)
        ways = ways_of(context, relations)
        if context.scene.target_id is not None:
            return self._free_target(context, ways, rng)
        return self._search(context, ways, rng)

    def _free_target(
        self, context: PlanningContext, ways: dict[int, Ways], rng: np.random.Generator
    ) -> Decision:
        config, target = self.config, TARGET_ID
        way = ways[target]
        candidates = blockers_of(target, ways, config.search.candidates)
        sets = sets_up_to(len(candidates), config.search.depth)
        masks = sets.masks.tolist()
        steps = removal_costs(ways, candidates, masks, config.prices)
        stop = target_costs(way, candidates, masks, context.picks_left, config.prices)
        plan = order_removals(steps, stop, sets)
        if not np.isfinite(plan.price):
            return self._otherwise(context, rng, "nothing that can be removed frees the target")
        if np.isfinite(stop[0]) and stop[0] <= plan.price + config.prices.worth_waiting:
            return Decision(
                target,
                f"Pick {context.called(target)}: it is the target, and no removal would make it easier to take.",
                evidence={"rule": "target"},
            )
        order = [candidates[i] for i in plan.order]
        return Decision(
            order[0],
            f"Pick {context.called(order[0])}: once {_named(order, context)} is gone the target can be taken.",
            evidence={"rule": "frees the target", "belief": {"order": order, "expected_picks": plan.price}},
        )

    def _search(self, context: PlanningContext, ways: dict[int, Ways], rng: np.random.Generator) -> Decision:
        config = self.config
        support_z_m = float(context.volume.grid.origin[2])
        bodies = bodies_of(context.scene, support_z_m)
        particles = propose(context.volume, bodies, config.particles, rng)
        if len(particles) < config.particles.fewest:
            return self._otherwise(context, rng, "too few places fit a hidden target")
        eye = np.asarray(context.scene.observation.T_world_camera, dtype=float)[:3, 3]
        belief = believe(particles, context.volume, bodies, eye, config.hiding, rng)
        suspects = suspects_of(context)
        candidates = candidates_of(belief, suspects, ways, config)
        sets = sets_up_to(len(candidates), min(config.search.depth, max(context.picks_left - 1, 1)))
        places = places_of(
            belief, candidates, config.hiding.reveal_share, config.hiding.front_share, suspects
        )
        costs = removal_costs(ways, candidates, sets.masks.tolist(), config.prices)
        fees = np.array([1 / max(ways[k].best, 0.25) for k in candidates])
        prices = SearchPrices(
            fees, 1.1, config.prices.still_blocking, config.prices.fallen, config.prices.unfound
        )
        plan = plan_search(places, costs, sets, prices)
        if not plan.order:
            return self._otherwise(context, rng, "no removal shows where the target may be")
        order = [candidates[i] for i in plan.order]
        return Decision(
            order[0],
            f"Pick {context.called(order[0])}: {_reveals(places, plan):.0%}",
            evidence={
                "rule": "search",
                "belief": {"order": order, "expected_picks": plan.price / max(places.weights.sum(), 1e-9)},
            },
        )

    def _otherwise(self, context: PlanningContext, rng: np.random.Generator, why: str) -> Decision:
        decision = self._fallback.decide(context, rng)
        return replace(decision, evidence={**decision.evidence, "fallback": why})


def _reveals(places: Places, plan: Plan) -> float:
    mask = np.array([1 << plan.order[0]], dtype=np.uint32)
    return float(places.weights @ places.revealed(mask)[:, 0])


def _named(ids: Sequence[int], context: PlanningContext) -> str:
    return ", ".join(context.called(k) for k in ids)


def suspects_of(context: PlanningContext) -> dict[int, float]:
    """How surely each object in sight is a target that perception has not recognised; sums to at most 1."""
    p = {k.id: k.target_p for k in context.scene.known if k.id in context.scene.ids and k.target_p >= _WORTH}
    total = max(sum(p.values()), 1.0)
    return {k: v / total for k, v in p.items()}


def candidates_of(
    belief: Belief, suspects: dict[int, float], ways: dict[int, Ways], config: BeliefConfig
) -> tuple[int, ...]:
    """The objects whose removal is considered: those with the most of the belief behind them or that may be the target,
    and what blocks their grasps or lies on them."""
    behind = belief.mass_behind()
    worth = {k: float(behind[k]) + suspects.get(k, 0.0) for k in ways}
    ranked = sorted((k for k in ways if worth[k] >= config.search.least_share), key=lambda k: (-worth[k], k))
    return with_blockers(ranked, ways, config.search.candidates)


def blockers_of(target: int, ways: dict[int, Ways], most: int) -> tuple[int, ...]:
    """The objects whose removal may free the target: what lies on it or blocks a grasp of it, and so on."""
    return tuple(k for k in with_blockers([target], ways, most + 1) if k != target)


def with_blockers(wanted: Sequence[int], ways: dict[int, Ways], most: int) -> tuple[int, ...]:
    """The wanted objects and those in their way, up to a number: each object is followed by what has to go before it.
    """
    chosen: list[int] = []

    def add(k: int) -> None:
        if k in chosen or len(chosen) >= most or k not in ways:
            return
        chosen.append(k)
        way = ways[k]
        first = [j for j in ways if way.on_it >> j & 1]
        if not way.now:
            sets = sorted({(b.bit_count(), -p, b) for p, b in zip(way.scores, way.blockers) if b})
            for _, _, bits in sets:
                first += [j for j in ways if bits >> j & 1 and j not in first]
        for j in first:
            add(j)

    for k in wanted:
        add(k)
    return tuple(chosen)
