"""Which decisions of a problem are taken: looks that planners come to, and no look twice."""

from collections.abc import Callable, Iterator

import numpy as np

from torc import PlanningContext
from torc.records import TARGET_ID
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.random_choice import RandomPlanner

MOST_DEEP = 6
"""Objects gone at most: further on few problems are left."""
Gone = frozenset[int]
Look = Callable[[Gone], PlanningContext]


def visits(look: Look, count: int, rng: np.random.Generator) -> tuple[Gone, ...]:
    """Objects gone at up to so many decisions: the first look, and then in turn one on the way of DG-SELECT, and one
    on the way of RANDOM, which mostly is where the target is still far. Where the target can be picked, one look is
    enough: there the answer is easy.
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
    """Looks of an ideal retrieval."""
    gone = Gone()
    while len(gone) <= MOST_DEEP:
        yield gone
        chosen = planner.decide(look(gone), rng).object_id
        if chosen in (None, TARGET_ID):
            return
        gone |= {chosen}
