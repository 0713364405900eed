"""Retrievals without luck: each pick takes its object away, and nothing else happens."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from torc.episode.privileged import Sandbox
from torc.oracle.promise import rough_plans
from torc.oracle.solve import MAX_PICKS, best_hold, options_of
from torc.records import TARGET_ID, PlanningContext
from torc.task_planning.protocol import TaskPlanner

_LEAST_P = 0.05
Look = Callable[[Collection[int]], PlanningContext]
"""Returns the look when these objects are gone, all of them taken without a failure."""


@dataclass(frozen=True)
class Retrieval:
    """The objects that a planner took, the target last if it was taken, and the expected tries of their grasps: the sum
    of 1 / p(hold).
    """

    order: tuple[int, ...] = ()
    tries: float = 0.0
    taken: bool = False

    @property
    def picks(self) -> int:
        """Picks used; all that there are if the target was not taken."""
        return len(self.order) if self.taken else MAX_PICKS


def looks_of(sandbox: Sandbox) -> Look:
    """Return a function that looks from the problem's beginning, once per set of objects.

    It remembers nothing that was seen only in between, neither at first nor now. Raises PhysicsError.
    """
    start, known = sandbox.begin(), dict[frozenset[int], PlanningContext]()

    def look(gone: Collection[int]) -> PlanningContext:
        key = frozenset(gone)
        if key not in known:
            known[key] = sandbox.look_without(start, key).context
        return known[key]

    return look


def retrieve(planner: TaskPlanner, look: Look, begun: Retrieval | None = None) -> Retrieval:
    """Play the planner from what was taken until it has the target, takes nothing, or has no pick left."""
    found, rng = begun or Retrieval(), np.random.default_rng(0)
    while len(found.order) < MAX_PICKS and not found.taken:
        context = look(found.order)
        chosen = planner.decide(context, rng).object_id
        if chosen is None:
            break
        found = after(found, context, chosen)
    return found


def after(found: Retrieval, context: PlanningContext, chosen: int) -> Retrieval:
    """Return the retrieval with one more object, taken at this look."""
    tries = found.tries + 1 / max(best_hold(context, chosen), _LEAST_P)
    return Retrieval((*found.order, chosen), tries, chosen == TARGET_ID)


def shortest(look: Look, most_looks: int) -> int | None:
    """Return the picks of the shortest order, the target's included, if found within this many looks.

    It knows what hides the target: nobody who must look for it can do that on average.
    """
    plans = rough_plans(lambda gone: options_of(look(gone)), options_of(look(())))
    for _, (picks, order) in zip(range(most_looks), plans):
        if order is not None:
            return picks
    return None
