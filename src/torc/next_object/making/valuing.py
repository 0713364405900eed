"""What each choice is worth: the picks to be expected until the target is brought, if it is made now.

The value is privileged: it knows what hides the target. A pick takes the expected tries of the object's best grasp,
1 / p(hold), with the mean p(hold) of several looks, whose grasps are drawn anew (0 where a look finds none); only for
the first try the grasp is known. For the target, which a failed try may lose with all picks that are left, see
`torc.task_planning.expected_picks`. What follows is the cheapest order that a search finds, where each pick takes its
object away and does nothing else (`torc.episode.ideal`). What has no grasp is a wasted pick: one, and then the best
choice.

The interval of a value has two parts. p(hold) may be off by CALIBRATION_ERROR, in every pick of the order alike: the
difference between promised and delivered of the grasp model with masks and depth (docs/grasp_model.md), rounded up. And
the search is bounded: the low end is what no order that was not looked at can be below, if the picks that are left, of
which one at least is the target's, never fail. What it does not cover: objects that fall or roll, which an ideal pick
does not make.
"""

import heapq
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from torc.episode.ideal import MAX_PICKS, best_hold
from torc.episode.oracle.solve import options_of
from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID, PlanningContext
from torc.task_planning.expected_picks import expected_picks

CALIBRATION_ERROR = 0.03
_LEAST_P = 0.05
_CLOSE = 0.03
"""Picks; a bound this near to what was found is as good as a proof."""
Gone = frozenset[int]


@dataclass(frozen=True)
class Price:
    """Expected picks, and the least and most if p(hold) is off."""

    mean: float = 0.0
    low: float = 0.0
    high: float = 0.0

    def __add__(self, other: "Price") -> "Price":
        return Price(self.mean + other.mean, self.low + other.low, self.high + other.high)


_NEVER = Price(float(MAX_PICKS), float(MAX_PICKS), float(MAX_PICKS))


@dataclass(frozen=True)
class Seen:
    """What a look tells of the search: what each graspable object takes, the most promising first; what the target
    takes, None if it cannot be picked; how near the retrieval looks.
    """

    others: Mapping[int, Price]
    target: Price | None
    outlook: float


Peek = Callable[[Gone], Seen]
"""What would be seen if these objects were gone. Raises PhysicsError."""


@dataclass(frozen=True)
class Valued:
    """Value of each choice by object id, with its interval; the order that it is the price of, for what can be picked
    (the choice first, the target last; empty where none was found); `looks` that it took, and whether every interval is
    as narrow as p(hold) allows.
    """

    values: Mapping[int, Price]
    orders: Mapping[int, tuple[int, ...]]
    looks: int
    proved: bool


def seen_in(contexts: Sequence[PlanningContext]) -> Seen:
    """What matters of looks at the same, whose grasps are drawn anew in each."""
    options, left = [options_of(context) for context in contexts], contexts[0].picks_left
    found = dict.fromkeys(k for one in options for k in one.choices if k is not None)
    holds = {k: float(np.mean([best_hold(context, k) for context in contexts])) for k in found}
    target = holds.pop(TARGET_ID, 0.0)
    prices = {k: _price(p, left) for k, p in holds.items() if p > 0}
    return Seen(prices, _price(target, left, True) if target > 0 else None, options[0].outlook)


def first_prices(context: PlanningContext, seen: Seen) -> dict[int, Price]:
    """What each choice takes at the look that is shown: the grasp of the first try is known, those of further ones are
    not.
    """
    again = dict(seen.others) | ({} if seen.target is None else {TARGET_ID: seen.target})
    found: dict[int, Price] = {}
    for k in options_of(context).choices:
        if k is not None and k in again:
            lost = BetConfig().lost_share if k == TARGET_ID else 0.0
            p, rest = best_hold(context, k), again[k]
            tries = ((p, rest.mean), (p + CALIBRATION_ERROR, rest.low), (p - CALIBRATION_ERROR, rest.high))
            found[k] = Price(*(_first_try(q, most, lost, context.picks_left) for q, most in tries))
    return found


def _first_try(p: float, rest: float, lost_share: float, picks_left: int) -> float:
    """Picks, where a failed try either leads to `rest` or loses all that are left."""
    p = min(max(p, 0.0), 1.0)
    return min(1 + (1 - p) * ((1 - lost_share) * rest + lost_share * picks_left), float(MAX_PICKS))


def _price(p: float, picks_left: int, is_target: bool = False) -> Price:
    lost = BetConfig().lost_share if is_target else 0.0

    def cost(q: float) -> float:
        return min(expected_picks(min(max(q, _LEAST_P), 1.0), lost, picks_left), float(MAX_PICKS))

    return Price(cost(p), cost(p + CALIBRATION_ERROR), cost(p - CALIBRATION_ERROR))


def value_choices(
    peek: Peek,
    gone: Gone,
    visible: tuple[int, ...],
    most_looks: int,
    first: Mapping[int, Price] | None = None,
) -> Valued:
    """Values of all visible objects where these are gone. `most_looks` bounds the looks that were not taken before:
    `peek` remembers its own, which cost nothing. `first`: what can be picked at the look that is shown, and what that
    takes, if not as at any look. Raises ValueError where nothing can be picked.
    """
    search = _Search(peek, gone, most_looks, first)
    search.run()
    graspable, orders = search.values()
    best = min(graspable.values(), key=lambda price: price.mean)
    wasted = Price(1.0, 1.0, 1.0) + Price(best.mean, min(p.low for p in graspable.values()), best.high)
    values = {k: graspable.get(k, wasted) for k in visible}
    return Valued(values, orders, search.spent, not any(b.open for b in search.branches))


@dataclass(frozen=True)
class _Node:
    gone: Gone
    price: Price
    order: tuple[int, ...]
    bound: float


@dataclass
class _Branch:
    """The search from one choice on: what was found, and what is still open."""

    first: int
    cost: Price
    found: Price | None = None
    order: tuple[int, ...] = ()
    bound: float = 1.0
    waiting: list[tuple[float, float, int, _Node]] = field(default_factory=list)
    known: set[Gone] = field(default_factory=set)

    @property
    def open(self) -> bool:
        """Whether something better may come of going on."""
        return bool(self.waiting) and self.lowest < (self.found or _NEVER).mean - _CLOSE

    @property
    def lowest(self) -> float:
        """What no order that was not looked at takes less than, if what is left never fails."""
        return self.waiting[0][0] if self.waiting else float("inf")


class _Search:
    def __init__(
        self, peek: Peek, gone: Gone, most_looks: int, first: Mapping[int, Price] | None = None
    ) -> None:
        self._peek, self._gone, self._most = peek, gone, most_looks
        self._known: dict[Gone, Seen] = {}
        self.spent = 0
        self._numbers = itertools.count()
        self._now = self._look(gone)
        if first is not None:
            # Most promising first, as at any look.
            known = [k for k in (*self._now.others, *first) if k in first and k != TARGET_ID]
            others = {k: first[k] for k in known}
            self._now = Seen(others, first.get(TARGET_ID), self._now.outlook)
        self.branches = [self._branch(k, price) for k, price in self._now.others.items()]
        if not self.branches and self._now.target is None:
            raise ValueError("Nothing can be picked, so there is nothing to choose.")

    def run(self) -> None:
        """Find a good order, carry it over to all choices, then look where something better may be."""
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
                leader = min(self.branches, key=lambda b: b.cost.mean + (b.found or _NEVER).mean)
                self._carry_over((leader.first, *leader.order))

    def values(self) -> tuple[dict[int, Price], dict[int, tuple[int, ...]]]:
        """Of everything that can be picked, with their orders."""
        found = {b.first: self._value(b) for b in self.branches}
        orders = {b.first: (b.first, *b.order) if b.order else () for b in self.branches}
        if self._now.target is not None:
            found[TARGET_ID], orders[TARGET_ID] = self._now.target, (TARGET_ID,)
        # Something that is taken to no end cannot make what was found for the rest worse than it is.
        first = min(found, key=lambda k: found[k].mean)
        best = found[first]
        for b in self.branches:
            if b.found is None or b.found.mean > best.mean:
                rest = b.cost + best
                if rest.mean < found[b.first].mean:
                    found[b.first] = Price(rest.mean, min(found[b.first].low, rest.low), rest.high)
                    orders[b.first] = (b.first, *orders[first])
        return found, orders

    def _value(self, b: _Branch) -> Price:
        rest = b.found or _NEVER
        low = min(rest.low, b.lowest if b.open else rest.low)
        return b.cost + Price(rest.mean, max(low, 1.0), rest.high)

    @property
    def _affords(self) -> bool:
        return self.spent < self._most

    def _best(self) -> float:
        return min((b.cost.mean + (b.found or _NEVER).mean for b in self.branches), default=0.0)

    def _look(self, gone: Gone) -> Seen:
        if gone not in self._known:
            self.spent += 1
            self._known[gone] = self._peek(gone)
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
        """The most promising choice after the other, until the target can be picked."""
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
        """Without what need not go."""
        for k in plan[:-2]:
            less = tuple(j for j in plan if j != k)
            if self._affords and self._look(self._gone | set(less[:-1])).target is not None:
                plan = less
        return plan

    def _carry_over(self, plan: tuple[int, ...]) -> None:
        """Follow a plan after each choice."""
        for branch in self.branches:
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
