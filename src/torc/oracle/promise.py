"""Guess which picks lead to the target if every pick only took its object away. Never a proof.

The order of picks then does not matter, and a state is the set of objects that are gone. There are far fewer sets than
sequences, and no pick has to be tried to look at one.
"""

import heapq
import itertools
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic

from torc.oracle.tree import LOOK_COST, Choice, Cost, Options, State, Tree, Trial

RoughPlan = tuple[int, tuple[int, ...] | None]
"""One step of the search for plans: a lower bound on the picks of all plans not yet given; and the objects to pick in
order, the target last, or None if this step found nothing.
"""


def rough_plans(peek: Callable[[frozenset[int]], Options], now: Options) -> Iterator[RoughPlan]:
    """Yield all plans, the shortest first, one per set of objects to take away.

    Each step but the first takes one peek, which shows a look without these objects. Sets of one size are ordered by
    how near the target looked before their last object was added.
    """
    if now.target is not None:
        yield 1, (now.target,)
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
            yield size + 1, (*taken, options.target)
        else:
            yield size + 1, None
            extend(taken, detour, options)


@dataclass(frozen=True, order=True)
class Prospect:
    """Cost of the cheapest known sequence that begins with a trial: expected picks, with failures by experience, and
    the cost if no pick failed.
    """

    expected: float
    cost: Cost


class Promise(Generic[State]):
    """Sets of objects that free the target once they are gone, and what they promise for each open choice.

    The sets come from rough plans, from looks at real states, and from sequences that led to the target, without
    needless picks. No unknown rough plan has fewer picks than `rough_bound`; None: all are known.
    """

    def __init__(self, tree: Tree[State], share: float) -> None:
        """Start with the tree; `share` of its budget is for peeks."""
        self.rough_bound: int | None = 1
        self.spent = 0.0
        self._tree, self._most = tree, share * tree.budget
        self._freeing: Counter[frozenset[int]] = Counter()
        """In how many states each set freed the target, minus those in which it did not; peeks count once."""
        self._reachable: list[frozenset[int]] | None = None
        """The sets that count, each with what has to go before its objects can be picked; None: not computed yet."""
        self._offered: dict[int, set[frozenset[int]]] = defaultdict(set)
        self._plans: Iterator[RoughPlan] | None = None
        self._tries: dict[Choice, list[tuple[frozenset[int], bool]]] = defaultdict(list)

    @property
    def affords_peek(self) -> bool:
        """True if the budget for peeks allows one more."""
        return self._tree.affords(looks=1) and self.spent + LOOK_COST <= self._most

    def extend(self) -> None:
        """Take one step of the search for rough plans, the shortest first."""
        self._reachable = None
        if self._plans is None:
            self._plans = rough_plans(self._peek, self._tree.root.options)
        self.rough_bound, plan = next(self._plans, (None, None))
        if plan is not None:
            self._freeing.setdefault(frozenset(plan[:-1]), 1)

    def learn(self, trial: Trial[State]) -> None:
        """Learn from the outcome of a trial."""
        child = trial.child
        if child is None:
            return
        self._reachable = None
        self._tries[trial.choice].append((trial.node.gone, trial.choice in child.gone))
        self._note(child.gone, child.options)
        if child.options.target is not None:
            self._freeing[child.gone] += 1
        else:
            self._freeing.subtract([s for s in self._freeing if s <= child.gone])

    def shrink(self, gone: Sequence[int]) -> None:
        """Find out, one by one, which of the objects that were gone before the target need not be."""
        needed = frozenset(gone)
        for k in gone:
            if self.affords_peek and self._peek(needed - {k}).target is not None:
                needed -= {k}
                self._reachable = None
                self._freeing.setdefault(needed, 1)

    def of(self, trial: Trial[State]) -> Prospect | None:
        """Return what a trial promises; None if nothing is known."""
        gone, before, drops = trial.gone, trial.node.gone, trial.node.cost.drops
        picks, risk = trial.node.cost.picks + 1, self._risk(trial.choice, before)
        if trial.is_target:
            return Prospect(picks + risk, Cost(picks, drops))
        if self._reachable is None:
            self._note(frozenset(), self._tree.root.options)
            # A set that has broken its promise more often than it kept it no longer counts.
            closed = {closure(s, self._offered) for s, kept in self._freeing.items() if kept >= 0}
            self._reachable = [s for s in closed if s is not None]
        prospects = []
        for freeing in self._reachable:
            # If all of a set are gone and the target is not free yet, the set has broken its promise.
            if not freeing <= before:
                missing = freeing - gone
                total = picks + len(missing) + 1
                risks = risk + sum(self._risk(k, (gone | freeing) - {k}) for k in missing)
                prospects.append(Prospect(total + risks, Cost(total, drops)))
        return min(prospects, default=None)

    def _risk(self, choice: Choice, gone: frozenset[int]) -> float:
        """Return the expected failures in picking an object when these are gone."""
        tries = self._tries[choice]
        if any(worked and before <= gone for before, worked in tries):
            return 0.0
        return sum(not worked for _, worked in tries) / (len(tries) + 1)

    def _note(self, gone: frozenset[int], options: Options) -> None:
        for k in options.choices:
            if k is not None:
                self._offered[k].add(gone)

    def _peek(self, removed: frozenset[int]) -> Options:
        before = self._tree.spent.total
        options = self._tree.peek(removed)
        self._note(removed, options)
        self.spent += self._tree.spent.total - before
        return options


def closure(
    wanted: frozenset[int], offered: Mapping[int, Collection[frozenset[int]]]
) -> frozenset[int] | None:
    """Return objects that can be picked one after the other until all wanted ones are gone; None if none are known.

    `offered` are, per object, sets whose removal lets it be picked; it still can be when more are gone.
    """
    needed, gone = wanted, frozenset[int]()
    while gone < needed:
        free = {k for k in needed - gone if any(s <= gone for s in offered.get(k, ()))}
        if free:
            gone |= free
            continue
        more = [s - needed for k in needed - gone for s in offered.get(k, ()) if not s <= needed]
        if not more:
            return None
        needed |= min(more, key=lambda s: (len(s), sorted(s)))
    return needed
