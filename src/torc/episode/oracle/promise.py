"""What promises to lead to the target, if every pick did nothing but take its object away. A guess, never a proof.

Then the order of picks does not matter, and a state is the set of objects that are gone: far fewer than there are
sequences, and no pick has to be tried to look at one.
"""

import heapq
import itertools
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic

from torc.episode.oracle.found import LOOK_COST, Cost
from torc.episode.oracle.space import Choice, Options, State
from torc.episode.oracle.tree import Tree, Trial


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
    """All plans, the shortest first, one per set of objects to take away. Each step but the first takes one peek, which
    tells what a look would if these objects were gone. Among sets of one size those come first without whose last
    object the target looked nearest.
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


@dataclass(frozen=True, order=True)
class Prospect:
    """What the cheapest sequence that begins with a trial would cost, as far as is known: picks with the failures to
    be expected by experience, and the cost if no pick failed."""

    expected: float
    cost: Cost


class Promise(Generic[State]):
    """Sets of objects that free the target once they are gone, and what they promise for each open choice.

    The sets come from rough plans, from looks at real states, and from sequences that led to the target, less what
    need not have been picked.

    Attributes:
        rough_bound: no rough plan that is not known yet has fewer picks; None: all are known.
    """

    def __init__(self, tree: Tree[State], share: float) -> None:
        """share: of the budget, for peeks."""
        self.rough_bound: int | None = 1
        self.lessons = 0
        self.spent = 0.0
        self._tree, self._most = tree, share * tree.budget
        self._freeing: Counter[frozenset[int]] = Counter()
        """In how many states each set freed the target, less those in which it did not; peeks count once."""
        self._orders: tuple[int, list[frozenset[int]]] | None = None
        self._offered: dict[int, set[frozenset[int]]] = {}
        self._plans: Iterator[RoughPlan] | None = None
        self._tries: dict[Choice, list[tuple[frozenset[int], bool]]] = {}

    @property
    def affords_peek(self) -> bool:
        """Whether the budget for peeks allows for one more."""
        return self._tree.affords(looks=1) and self.spent + LOOK_COST <= self._most

    def extend(self) -> None:
        """One step of the search for rough plans, the shortest first."""
        self.lessons += 1
        if self._plans is None:
            self._plans = rough_plans(self._peek, self._tree.root.options)
        step = next(self._plans, None)
        self.rough_bound = None if step is None else step.picks
        if step is not None and step.plan is not None:
            self._freeing.setdefault(frozenset(step.plan[:-1]), 1)

    def learn(self, trial: Trial[State]) -> None:
        """Take in what came of a trial."""
        child = trial.child
        if child is None:
            return
        self.lessons += 1
        self._tries.setdefault(trial.choice, []).append((trial.node.gone, trial.choice in child.gone))
        self._note(child.gone, child.options)
        if child.options.target is not None:
            self._freeing[child.gone] += 1
        else:
            self._freeing.subtract([s for s in self._freeing if s <= child.gone])

    def shrink(self, gone: Sequence[int]) -> None:
        """Find out, one after the other, which of the objects that were gone before the target need not be."""
        needed = frozenset(gone)
        for k in gone:
            if self.affords_peek and self._peek(needed - {k}).target is not None:
                needed -= {k}
                self.lessons += 1
                self._freeing.setdefault(needed, 1)

    def of(self, trial: Trial[State]) -> Prospect | None:
        """What a trial promises; None where nothing is known."""
        gone, cost, before = trial.gone, trial.node.cost, trial.node.gone
        risk = self._risk(trial.choice, before)
        if trial.is_target:
            return Prospect(cost.picks + 1 + risk, Cost(cost.picks + 1, cost.drops))
        # Where all of a set are gone and the target is not free yet, the set has kept no promise.
        useful = [s for s in self._reachable() if not s <= before]
        return min((self._by(s, gone, cost, risk) for s in useful), default=None)

    def _by(self, freeing: frozenset[int], gone: frozenset[int], cost: Cost, risk: float) -> Prospect:
        missing = freeing - gone
        picks = cost.picks + len(missing) + 2
        risk += sum(self._risk(k, (gone | freeing) - {k}) for k in missing)
        return Prospect(picks + risk, Cost(picks, cost.drops))

    def _risk(self, choice: Choice, gone: frozenset[int]) -> float:
        """Failures to be expected in picking an object where these are gone, by those that were seen."""
        tries = self._tries.get(choice, ())
        if any(worked and before <= gone for before, worked in tries):
            return 0.0
        return sum(not worked for _, worked in tries) / (len(tries) + 1)

    def _note(self, gone: frozenset[int], options: Options) -> None:
        for k in options.choices:
            if k is not None:
                self._offered.setdefault(k, set()).add(gone)

    def _reachable(self) -> list[frozenset[int]]:
        """The sets that free the target, each with what has to go before its objects can be picked.

        A set that has broken its promise more often than it kept it counts no longer.
        """
        if self._orders is None or self._orders[0] != self.lessons:
            self._note(frozenset(), self._tree.root.options)
            closed = {closure(s, self._offered) for s, kept in self._freeing.items() if kept >= 0}
            self._orders = self.lessons, [s for s in closed if s is not None]
        return self._orders[1]

    def _peek(self, removed: frozenset[int]) -> Options:
        before = self._tree.spent.total
        options = self._tree.peek(removed)
        self._note(removed, options)
        self.spent += self._tree.spent.total - before
        return options


def closure(
    wanted: frozenset[int], offered: Mapping[int, Collection[frozenset[int]]]
) -> frozenset[int] | None:
    """Objects that can be picked one after the other until all that are wanted are gone; None where none are known.
    `offered` are sets of objects with which gone an object could be picked; it still can be when more are gone.
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
