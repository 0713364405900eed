"""A target in sight: take it, or remove what makes it easier to take first."""

from dataclasses import dataclass

import numpy as np

from torc.records import TARGET_ID, PlanningContext
from torc.task_planning.belief.candidates import with_obstacles
from torc.task_planning.belief.costs import Ways, removal_costs, target_costs
from torc.task_planning.belief.search import order_removals, sets_up_to
from torc.task_planning.belief.settings import BeliefConfig


@dataclass(frozen=True)
class Access:
    """How to get at a target in sight.

    Attributes:
        order: ids of the objects to remove before it is taken, in this order.
        picks: expected picks, the target's own included; infinite where no removal frees it.
        now: expected picks if it is taken at once; infinite where it cannot be.
    """

    order: tuple[int, ...]
    picks: float
    now: float


def free_target(context: PlanningContext, ways: dict[int, Ways], config: BeliefConfig) -> Access:
    """The cheapest way to the target, over all sets of removals up to the search's depth.

    The search is that for a hidden target with a single place, in sight: a set of removals frees it or not, so a grasp
    that two objects block needs both gone.
    """
    candidates = with_obstacles([TARGET_ID], ways, config.search.candidates + 1)[1:]
    sets = sets_up_to(len(candidates), min(config.search.depth, max(context.picks_left - 1, 0)))
    steps = removal_costs(ways, candidates, sets.masks, config.prices)
    stop = target_costs(ways[TARGET_ID], candidates, sets.masks, context.picks_left, config.prices)
    plan, now = order_removals(steps, stop, sets), float(stop[0])
    if np.isfinite(now) and now <= plan.price + config.prices.worth_waiting:
        return Access((), now, now)
    return Access(tuple(candidates[i] for i in plan.order), plan.price, now)
