"""Rough plans: sequences that would lead to the target if every pick did nothing but take its object away.

Then the order does not matter, and a state is the set of objects that are gone: far fewer than there are sequences, and
no pick has to be tried to look at one.
"""

import heapq
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from torc.episode.oracle.space import Options


@dataclass(frozen=True)
class RoughPlan:
    """One step of the search for plans.

    Attributes:
        picks: no plan that has not been given yet is shorter.
        plan: the objects to pick in order, the target last; None: nothing found in this step.
    """

    picks: int
    plan: tuple[int, ...] | None = None


def rough_plans(peek: Callable[[frozenset[int]], Options], now: Options) -> Iterator[RoughPlan]:
    """All plans, the shortest first, one per set of objects to take away. Each step but the first takes one peek.

    Among sets of one size those come first without whose last object the target looked nearest.

    Args:
        peek: what a look would tell if these objects were gone.
        now: what it tells while nothing is.
    """
    if now.target is not None:
        yield RoughPlan(1, (now.target,))
    numbers = itertools.count()
    waiting: list[tuple[int, float, int, int, tuple[int, ...]]] = []
    known: set[frozenset[int]] = set()

    def extend(taken: tuple[int, ...], detour: int, options: Options) -> None:
        others = [k for k in options.choices if k is not None and k != options.target]
        for rank, k in enumerate(others):
            gone = frozenset((*taken, k))
            if gone not in known:
                known.add(gone)
                place = (len(gone), -options.outlook, detour + rank, next(numbers))
                heapq.heappush(waiting, (*place, (*taken, k)))

    extend((), 0, now)
    while waiting:
        size, _, detour, _, taken = heapq.heappop(waiting)
        options = peek(frozenset(taken))
        if options.target is not None:
            yield RoughPlan(size + 1, (*taken, options.target))
        else:
            yield RoughPlan(size + 1)
            extend(taken, detour, options)
