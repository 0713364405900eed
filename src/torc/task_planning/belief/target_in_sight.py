"""Decide about a target in sight: take it, or first remove what makes it easier to take."""

from dataclasses import dataclass

import numpy as np

from torc.records import PlanningContext
from torc.task_planning.belief.candidates import with_obstacles
from torc.task_planning.belief.costs import (
    UNREMOVABLE,
    Ways,
    as_bits,
    clearing_costs,
    removal_costs,
    target_costs,
)
from torc.task_planning.belief.search import order_removals, sets_up_to
from torc.task_planning.belief.settings import BeliefConfig


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
