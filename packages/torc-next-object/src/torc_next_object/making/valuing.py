"""Value each choice: the expected picks until the target is delivered, if the choice is made now.

The value is privileged: it knows what hides the target. The choice is tried once, with the grasp that is shown. If it
fails, the best choice at any look follows; else the cheapest order that a search finds. There a pick costs its object's
price (`pricing`), removes it and does nothing else (`torc.oracle.solve`). An object without a grasp is a wasted pick.

The interval of a value has two parts. p(hold) may be off, equally in every pick of the order. And the search is
bounded: no order that was not looked at can be below the low end, if its remaining picks, at least the target's, never
fail. The interval does not cover objects that fall or roll, which an ideal pick does not cause.
"""

import heapq
import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from torc.oracle.solve import MAX_PICKS
from torc.records import TARGET_ID
from torc_next_object.making.pricing import NEVER, Price, Try

_CLOSE = 0.03
"""Picks: a bound this near to the order that was found counts as a proof."""
Gone = frozenset[int]


@dataclass(frozen=True)
class Seen:
    """A look as the search needs it.

    Attributes:
        others: the price of each graspable object but the target, the most promising first.
        target: the target's price; None if it cannot be picked.
        outlook: how near the retrieval looks.
    """

    others: Mapping[int, Price]
    target: Price | None
    outlook: float

    @property
    def prices(self) -> dict[int, Price]:
        """All prices, the target's too."""
        return dict(self.others) | ({} if self.target is None else {TARGET_ID: self.target})


class Seeing(Protocol):
    """Looks without some objects. All methods raise PhysicsError."""

    def seen(self, gone: Gone) -> Seen:
        """Return the look, the same each time."""

    def price(self, gone: Gone, object_id: int) -> Price:
        """Price an object of which `seen` found no grasp: more looks may find one, else NEVER."""


@dataclass(frozen=True)
class Valued:
    """The values of all choices.

    Attributes:
        values: by object id, with intervals.
        orders: for each object that can be picked, the order that follows if its first try succeeds: the choice first,
            the target last; empty if none was found.
        otherwise: the best order at any look, which follows if the first try fails.
        looks: number of looks that the search took.
        proved: every interval is as narrow as p(hold) allows.
    """

    values: Mapping[int, Price]
    orders: Mapping[int, tuple[int, ...]]
    otherwise: tuple[int, ...]
    looks: int
    proved: bool


def value_choices(
    seeing: Seeing, gone: Gone, visible: tuple[int, ...], most_looks: int, first: Mapping[int, Try]
) -> Valued:
    """Value all visible objects where `gone` are removed, from at most `most_looks` different looks.

    `first` are the objects that can be picked at the look that is shown. Raises ValueError if there are none.
    """
    search = _Search(seeing, gone, most_looks, first)
    search.run()
    rests, orders = search.found()
    totals = {k: search.again.get(k, NEVER) + rest for k, rest in rests.items()}
    leader = min(totals, key=lambda k: totals[k].mean)
    otherwise = Price(totals[leader].mean, min(p.low for p in totals.values()), totals[leader].high)
    values = dict.fromkeys(visible, Price(1.0, 1.0, 1.0) + otherwise)
    values |= {k: tried.then(rests[k], otherwise) for k, tried in first.items()}
    open_still = any(b.open for b in search.branches)
    shown = {k: orders[k] for k in first}
    return Valued(values, shown, orders[leader], search.spent, not open_still)


@dataclass(frozen=True)
class _Node:
    gone: Gone
    price: Price
    order: tuple[int, ...]
    bound: float


@dataclass
class _Branch:
    """The search from one choice on: the order that was found, and what is still open."""

    first: int
    cost: Price
    found: Price | None = None
    order: tuple[int, ...] = ()
    waiting: list[tuple[float, float, int, _Node]] = field(default_factory=list)
    known: set[Gone] = field(default_factory=set)

    @property
    def open(self) -> bool:
        """Whether going on may find a better order."""
        return bool(self.waiting) and self.lowest < (self.found or NEVER).mean - _CLOSE

    @property
    def lowest(self) -> float:
        """Lower bound of all orders that were not looked at, if their remaining picks never fail."""
        return self.waiting[0][0] if self.waiting else float("inf")


class _Search:
    """Searches orders. `again` prices what can be picked at any look without `gone`; `shown` can be picked now."""

    def __init__(self, seeing: Seeing, gone: Gone, most_looks: int, shown: Iterable[int]) -> None:
        self._seeing, self._gone, self._most = seeing, gone, most_looks
        self._known: dict[Gone, Seen] = {}
        self.spent = 0
        self._numbers = itertools.count()
        self.again = self._look(gone).prices
        choices = dict.fromkeys((*self.again, *shown))
        if not choices:
            raise ValueError("Nothing can be picked, so there is nothing to choose.")
        self._target_free = TARGET_ID in choices
        self.branches = [self._branch(k, self.again.get(k, NEVER)) for k in choices if k != TARGET_ID]

    def run(self) -> None:
        """Find a good order, carry it over to all choices, then look where a better one may be."""
        plan = self._shrunk(self._first_plan())
        self._carry_over(plan)
        while self._affords:
            branches = [b for b in self.branches if b.open]
            if not branches:
                return
            branch = min(branches, key=lambda b: (b.cost.mean + b.lowest, b.first))
            before = self._best()
            self._expand(branch)
            if self._best() < before - _CLOSE:
                leader = min(self.branches, key=lambda b: b.cost.mean + (b.found or NEVER).mean)
                self._carry_over((leader.first, *leader.order))

    def found(self) -> tuple[dict[int, Price], dict[int, tuple[int, ...]]]:
        """Return, by pick, the price of what follows once it is out, and the order, the pick itself first."""
        rests = {b.first: self._rest(b) for b in self.branches}
        orders = {b.first: (b.first, *b.order) if b.order else () for b in self.branches}
        if self._target_free:
            rests[TARGET_ID], orders[TARGET_ID] = Price(), (TARGET_ID,)
        # A pick that is early or needless hardly ever makes the others cost more than without it.
        best = orders[min(rests, key=lambda k: (self.again.get(k, NEVER) + rests[k]).mean)]
        steps = self._steps(best)
        for b in self.branches if best else ():
            others = [k for k in best if k != b.first]
            rest = self._after(b.first, others, steps)
            if rest.mean < rests[b.first].mean:
                rests[b.first] = Price(rest.mean, min(rests[b.first].low, rest.low), rest.high)
                orders[b.first] = (b.first, *others)
        return rests, orders

    def _steps(self, order: tuple[int, ...]) -> dict[int, Price]:
        """Return the price of each pick of an order that was found."""
        steps, gone = dict[int, Price](), self._gone
        for k in order:
            steps[k], gone = self._known[gone].prices.get(k, NEVER), gone | {k}
        return steps

    def _after(self, first: int, others: Iterable[int], steps: Mapping[int, Price]) -> Price:
        """Price the others once `first` is out: as in the best order, unless a look says that one cannot be picked.

        It may have lain on `first`, and fallen flat.
        """
        gone, rest = self._gone | {first}, Price()
        for k in others:
            seen = self._known.get(gone)
            there = seen is None or k in seen.prices
            rest += steps[k] if there else self._seeing.price(gone, k)
            gone |= {k}
        return rest

    def _rest(self, b: _Branch) -> Price:
        found = b.found or NEVER
        low = min(found.low, b.lowest if b.open else found.low)
        return Price(found.mean, max(low, 1.0), found.high)

    @property
    def _affords(self) -> bool:
        return self.spent < self._most

    def _best(self) -> float:
        return min((b.cost.mean + (b.found or NEVER).mean for b in self.branches), default=0.0)

    def _look(self, gone: Gone) -> Seen:
        if gone not in self._known:
            self.spent += 1
            self._known[gone] = self._seeing.seen(gone)
        return self._known[gone]

    def _branch(self, k: int, price: Price) -> _Branch:
        branch = _Branch(k, price)
        self._push(branch, _Node(self._gone | {k}, Price(), (), 1.0), 0.0)
        return branch

    def _push(self, branch: _Branch, node: _Node, outlook: float) -> None:
        if node.gone not in branch.known:
            branch.known.add(node.gone)
            heapq.heappush(branch.waiting, (node.bound, -outlook, next(self._numbers), node))

    def _expand(self, branch: _Branch) -> None:
        """Look at the most promising open set of a branch."""
        *_, node = heapq.heappop(branch.waiting)
        seen = self._look(node.gone)
        if seen.target is not None:
            self._arrive(branch, node.price + seen.target, (*node.order, TARGET_ID))
        for k, price in seen.others.items():
            spent = node.price + price
            self._push(branch, _Node(node.gone | {k}, spent, (*node.order, k), spent.low + 1.0), seen.outlook)

    def _arrive(self, branch: _Branch, price: Price, order: tuple[int, ...]) -> None:
        if branch.found is None or price.mean < branch.found.mean:
            branch.found, branch.order = price, order

    def _first_plan(self) -> tuple[int, ...]:
        """Take the most promising choice in turn, until the target can be picked."""
        gone, order = self._gone, tuple[int, ...]()
        while self._affords and len(order) < MAX_PICKS:
            seen = self._look(gone)
            if seen.target is not None and order:
                return (*order, TARGET_ID)
            if not seen.others:
                break
            k = next(iter(seen.others))
            gone, order = gone | {k}, (*order, k)
        return order

    def _shrunk(self, plan: tuple[int, ...]) -> tuple[int, ...]:
        """Drop what need not go."""
        for k in plan[:-2]:
            less = tuple(j for j in plan if j != k)
            if self._affords and self._look(self._gone | set(less[:-1])).target is not None:
                plan = less
        return plan

    def _carry_over(self, plan: tuple[int, ...]) -> None:
        """Follow a plan after each choice, its own ones first: they lead to the same sets."""
        for branch in sorted(self.branches, key=lambda b: b.first not in plan):
            gone, price, order = self._gone | {branch.first}, Price(), tuple[int, ...]()
            rest = [k for k in plan if k not in (branch.first, TARGET_ID)]
            while self._affords or gone in self._known:
                seen = self._look(gone)
                if seen.target is not None:
                    self._arrive(branch, price + seen.target, (*order, TARGET_ID))
                k = next((k for k in rest if k in seen.others), None)
                if k is None or seen.target is not None:
                    break
                rest.remove(k)
                gone, price, order = gone | {k}, price + seen.others[k], (*order, k)
