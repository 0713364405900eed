"""Plan the removals that reveal a hidden target, or that free one in sight."""

from dataclasses import dataclass

import numpy as np

from torc.records import PlanningContext
from torc.task_planning.belief.costs import (
    UNREMOVABLE,
    Ways,
    as_bits,
    clearing_costs,
    removal_costs,
    target_costs,
    with_obstacles,
)
from torc.task_planning.belief.hiding import Belief, believe
from torc.task_planning.belief.particles import bodies_of, propose, unseen_room
from torc.task_planning.belief.search import (
    TARGET_PICKS,
    Places,
    Plan,
    order_removals,
    places_of,
    plan_search,
    sets_up_to,
)
from torc.task_planning.belief.settings import BeliefConfig, GiveUpConfig, SearchConfig
from torc.task_planning.graph_building import WORTH, suspects_of


@dataclass(frozen=True)
class Search:
    """What the planner believes of a target out of sight, and what it would do.

    Attributes:
        candidates: ids of the objects whose removal is considered; `plan` and `places` number them in this order.
        room: share of the space over the support in which the target may be: a target of its size if that is known
            (`Particles.room`), else any (`unseen_room`).
        presence: probability that the target is there at all, after what was seen.
        suspects: probability of each object in sight to be the target.
        clearing: picks to remove all candidates, each without what blocks it.
    """

    belief: Belief
    candidates: tuple[int, ...]
    places: Places
    plan: Plan
    room: float
    presence: float
    suspects: dict[int, float]
    clearing: float

    @property
    def order(self) -> tuple[int, ...]:
        """Ids of the objects to remove, in order, until the target comes into sight."""
        return tuple(self.candidates[i] for i in self.plan.order)

    @property
    def expected_picks(self) -> float:
        """Expected picks to the target. Targets that no candidate reveals are taken once all candidates are gone.

        That is more than the plan counts, and probably too few.
        """
        return self.plan.price + self.places.beyond * (self.clearing + TARGET_PICKS)

    def reveals(self, object_ids: tuple[int, ...]) -> float:
        """Return the share of the belief that comes into sight once these candidates are gone."""
        mask = sum(1 << self.candidates.index(k) for k in object_ids)
        return float(self.places.weights @ self.places.revealed(np.array([mask], dtype=np.uint32))[:, 0])


def search_target(
    context: PlanningContext, ways: dict[int, Ways], config: BeliefConfig, rng: np.random.Generator
) -> Search:
    """Find what to remove to reveal the target; the plan is empty if no possible removal reveals anything."""
    volume, scene = context.volume, context.scene
    bodies = bodies_of(scene, volume)
    particles = propose(volume, bodies, config.particles, rng, context.target_size_m)
    eye = np.asarray(scene.observation.T_world_camera, dtype=float)[:3, 3]
    belief = believe(particles, volume, bodies, eye, config.hiding, rng)
    suspects, _ = suspects_of(scene)
    candidates = _candidates(belief, suspects, ways, config.search)
    places = places_of(belief, candidates, config.hiding, suspects)
    sets = sets_up_to(len(candidates), min(config.search.depth, max(context.picks_left - 1, 1)))
    p = config.prices
    costs = removal_costs(ways, candidates, sets.masks, p)
    clearing = clearing_costs(ways, candidates, as_bits(sets.masks, candidates), p)
    plan = plan_search(places, costs, clearing, sets, p)
    room = particles.room
    if room is None:
        room = unseen_room(volume, bodies, config.give_up.size_m, config.give_up.proposals, rng)
    rest = clearing_costs(ways, candidates, np.array([sum(1 << k for k in candidates)], np.uint64), p)
    there = presence(room, config.give_up)
    return Search(belief, candidates, places, plan, room, there, suspects, float(rest.sum()))


def presence(room: float, config: GiveUpConfig) -> float:
    """Return the probability that the target is there though no look has shown it (Bayes' rule).

    If it were anywhere over the support, with all columns of space alike, all but the share `room` would have shown it.
    """
    missed = config.presence * room
    return missed / max(missed + 1 - config.presence, 1e-12)


def _candidates(
    belief: Belief, suspects: dict[int, float], ways: dict[int, Ways], config: SearchConfig
) -> tuple[int, ...]:
    """Return objects with most of the belief behind them, or that may be the target, and what blocks them."""
    behind = belief.mass_behind()
    worth = {k: float(behind[k]) + suspects.get(k, 0.0) for k in ways}
    ranked = sorted((k for k in ways if worth[k] >= config.least_share), key=lambda k: (-worth[k], k))
    return with_obstacles(ranked, ways, config.candidates)


def may_have_been_seen(context: PlanningContext) -> bool:
    """Check whether the target may have been seen without being recognised, and still be there.

    True if perception suspects an object, did so when it last saw it, or does not know what the target looks like.
    """
    scene = context.scene
    # Ids are reused: an object in sight is not the one that was delivered under its id.
    brought = {outcome.object_id for outcome in context.history if outcome.delivered} - {*scene.ids}
    p = [k.target_p for k in scene.known if k.id not in brought]
    return bool(p) and (max(p) == 0 or max(p) >= WORTH)


@dataclass(frozen=True)
class Access:
    """How to get at a target in sight.

    Attributes:
        order: ids of the objects to remove before it is taken, in this order.
        picks: expected picks, including the target's own; infinite if no known removal helps.
        now: expected picks if it is taken at once; infinite if it cannot be.
        frees: whether these removals leave one of its grasps unblocked, as far as is known; otherwise they make way.
    """

    order: tuple[int, ...]
    picks: float
    now: float
    frees: bool = True


def free_target(context: PlanningContext, ways: dict[int, Ways], config: BeliefConfig) -> Access:
    """Find the cheapest way to the target, over all sets of removals up to the search's depth.

    The search is the one for a hidden target with a single place, in sight: a set of removals frees it or not, so a
    grasp that two objects block needs both gone.
    """
    target = context.scene.target_number
    candidates = with_obstacles([target], ways, config.search.candidates + 1)[1:]
    sets = sets_up_to(len(candidates), min(config.search.depth, max(context.picks_left - 1, 0)))
    steps = removal_costs(ways, candidates, sets.masks, config.prices)
    stop = target_costs(ways[target], candidates, sets.masks, context.picks_left, config.prices)
    now = float(stop[0])
    frees = np.isfinite(stop)
    at_end = ~frees & ~np.isfinite(steps + np.where(sets.following < 0, np.inf, 0.0)).any(axis=1)
    gone = as_bits(sets.masks[at_end], candidates)
    guess = clearing_costs(ways, [target], gone, config.prices)[:, 0]
    stop[at_end] = np.where(guess < UNREMOVABLE, config.prices.detour * guess, np.inf)
    plan = order_removals(steps, stop, sets)
    if np.isfinite(now) and now <= plan.price + config.prices.worth_waiting:
        return Access((), now, now)
    if not plan.order:
        return Access((), np.inf, now)
    order = tuple(candidates[i] for i in plan.order)
    left = ways[target].blockers & ~np.uint64(sum(1 << k for k in order))
    return Access(order, plan.price, now, frees=bool((left == 0).any()))
