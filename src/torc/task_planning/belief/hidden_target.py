"""Search for a target out of sight: from a look to the order of removals."""

from dataclasses import dataclass

import numpy as np

from torc.records import PlanningContext
from torc.task_planning.belief.bodies import bodies_of
from torc.task_planning.belief.candidates import candidates_of, suspects_of
from torc.task_planning.belief.costs import Ways, as_bits, clearing_costs, removal_costs
from torc.task_planning.belief.hiding import Belief, believe
from torc.task_planning.belief.particles import propose, unseen_room
from torc.task_planning.belief.search import Places, Plan, SearchPrices, places_of, plan_search, sets_up_to
from torc.task_planning.belief.settings import BeliefConfig, GiveUpConfig

_TARGET_PICKS = 1.1
"""Picks to take the target once it can be grasped."""


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
        return self.plan.price + self.places.beyond * (self.clearing + _TARGET_PICKS)

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
    suspects = suspects_of(context)
    candidates = candidates_of(belief, suspects, ways, config.search)
    places = places_of(belief, candidates, config.hiding, suspects)
    sets = sets_up_to(len(candidates), min(config.search.depth, max(context.picks_left - 1, 1)))
    p = config.prices
    costs = removal_costs(ways, candidates, sets.masks, p)
    clearing = clearing_costs(ways, candidates, as_bits(sets.masks, candidates), p)
    prices = SearchPrices(_TARGET_PICKS, p.still_blocking, p.fallen, p.detour)
    plan = plan_search(places, costs, clearing, sets, prices)
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
