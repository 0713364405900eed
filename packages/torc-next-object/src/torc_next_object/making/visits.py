"""Choose the decisions of a problem: looks that planners come to, none twice."""

from collections.abc import Callable, Iterator

import numpy as np

from torc import PlanningContext
from torc.records import TARGET_ID
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.random_choice import RandomPlanner

MOST_DEEP = 6
"""Largest number of removed objects: few problems go further."""
Gone = frozenset[int]
Look = Callable[[Gone], PlanningContext]


def visits(look: Look, count: int, rng: np.random.Generator) -> tuple[Gone, ...]:
    """Return the removed objects at up to `count` decisions.

    They are the first look, then in turn looks on the way of DG-SELECT and of RANDOM, where the target is mostly still
    far. At most one of them has a graspable target, where the answer is easy.
    """
    found, easy = list[Gone](), 0
    ways = [
        _way(look, DgSelectPlanner(), rng),
        _way(look, RandomPlanner(), rng),
        _way(look, RandomPlanner(), rng),
    ]
    while ways and len(found) < count:
        for way in list(ways):
            gone = next((g for g in way if g not in found), None)
            if gone is None:
                ways.remove(way)
                continue
            graspable = look(gone).graspable_ids
            if len(graspable) < 2 or (TARGET_ID in graspable and easy):
                continue
            easy += TARGET_ID in graspable
            found.append(gone)
    return tuple(found[:count])


def _way(look: Look, planner: DgSelectPlanner | RandomPlanner, rng: np.random.Generator) -> Iterator[Gone]:
    """Yield the looks of an ideal retrieval."""
    gone = Gone()
    while len(gone) <= MOST_DEEP:
        yield gone
        chosen = planner.decide(look(gone), rng).object_id
        if chosen in (None, TARGET_ID):
            return
        gone |= {chosen}
