"""The value of every choice, against plain enumeration in made-up worlds."""

from functools import cache
from itertools import chain, combinations

import numpy as np
import pytest

from torc.records import TARGET_ID
from torc_next_object.making.pricing import CALIBRATION_ERROR, NEVER, Price, Try
from torc_next_object.making.valuing import Seen, value_choices


class MadeUp:
    """Objects 1 to n, each free once its blockers are gone; the target, once one of some sets is gone."""

    def __init__(self, seed: int, n: int = 5) -> None:
        rng = np.random.default_rng(seed)
        self.prices = {k: float(rng.uniform(1.0, 2.5)) for k in range(1, n + 1)}
        self.target_price = float(rng.uniform(1.0, 2.0))
        self.blockers = {k: frozenset(j for j in range(1, k) if rng.random() < 0.3) for k in self.prices}
        some = [frozenset(rng.choice(n, size=rng.integers(1, 4), replace=False) + 1) for _ in range(2)]
        self.keys = [frozenset(map(int, key)) for key in some]
        self.looks = 0

    def open(self, gone: frozenset[int]) -> list[int]:
        return [k for k in self.prices if k not in gone and self.blockers[k] <= gone]

    def reached(self, gone: frozenset[int]) -> bool:
        return any(key <= gone for key in self.keys)

    def seen(self, gone: frozenset[int]) -> Seen:
        self.looks += 1
        others = {k: _around(self.prices[k]) for k in self.open(gone)}
        target = _around(self.target_price) if self.reached(gone) else None
        return Seen(others, target, -float(min(len(key - gone) for key in self.keys)))

    def price(self, gone: frozenset[int], k: int) -> Price:
        raise AssertionError("More room makes no pick harder here.")

    def least(self, gone: frozenset[int]) -> float:
        """Picks from here on by trying every order."""

        @cache
        def rest(now: frozenset[int]) -> float:
            taken = [self.target_price] if self.reached(now) else []
            return min(chain(taken, (self.prices[k] + rest(now | {k}) for k in self.open(now))))

        return rest(gone)

    def first(self, gone: frozenset[int] = frozenset()) -> dict[int, Try]:
        """Grasps at the shown look, all of them sure."""
        return dict.fromkeys((*self.open(gone), *([TARGET_ID] if self.reached(gone) else [])), Try(1.0))

    def wanted(self, gone: frozenset[int] = frozenset()) -> dict[int, float]:
        return {k: 1.0 + (self.least(gone | {k}) if k != TARGET_ID else 0.0) for k in self.first(gone)}


class Told:
    """What is seen is told by a function; further draws find a grasp of the objects in `more` alone."""

    def __init__(self, seen, more=None):
        self.seen, self.more = seen, more or {}

    def price(self, gone: frozenset[int], k: int) -> Price:
        return self.more.get(k, NEVER)


def _around(price: float) -> Price:
    return Price(price, price - CALIBRATION_ERROR, price + CALIBRATION_ERROR)


@pytest.mark.parametrize("seed", range(40))
def test_with_looks_enough_the_values_are_those_of_trying_every_order(seed):
    world = MadeUp(seed)
    valued = value_choices(world, frozenset(), tuple(world.prices), 10_000, world.first())
    assert valued.proved
    wanted = world.wanted()
    for k, value in wanted.items():
        # A bound within .03 of what was found is taken for a proof.
        assert value - 1e-9 <= valued.values[k].mean <= value + 0.03 + 1e-9
        assert valued.values[k].low <= value <= valued.values[k].high
    wasted = 1 + world.least(frozenset())
    closed = set(world.prices) - set(wanted)
    assert all(valued.values[k].mean == pytest.approx(wasted, abs=0.031) for k in closed)


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("most", [1, 4, 12])
def test_with_few_looks_the_true_value_lies_in_the_interval(seed, most):
    world = MadeUp(seed, n=6)
    valued = value_choices(world, frozenset(), tuple(world.prices), most, world.first())
    assert valued.looks == world.looks <= most
    for k, value in world.wanted().items():
        assert valued.values[k].low - 1e-9 <= value <= valued.values[k].mean + 1e-9


def test_a_target_that_can_be_picked_is_the_best_choice_but_for_a_doubtful_grasp():
    world = MadeUp(3)
    gone = max(world.keys, key=len)
    everything = frozenset(chain.from_iterable(combinations(sorted(gone), len(gone))))
    free = world.open(everything)
    valued = value_choices(world, everything, (TARGET_ID, *free), 10_000, world.first(everything))
    assert valued.values[TARGET_ID].mean == 1.0
    assert min(valued.values[k].mean for k in free) >= world.target_price + 1.0 - 1e-9
    doubtful = world.first(everything) | {TARGET_ID: Try(0.01)}
    valued = value_choices(world, everything, (TARGET_ID, *free), 10_000, doubtful)
    wanted = 1.0 + 0.99 * world.target_price
    assert valued.values[TARGET_ID].mean == pytest.approx(wanted)


def test_where_nothing_can_be_picked_there_is_no_value():
    with pytest.raises(ValueError, match="nothing to choose"):
        value_choices(Told(lambda _: Seen({}, None, 0.0)), frozenset(), (1, 2), 5, {})


@pytest.mark.parametrize("seed", range(10))
def test_the_first_try_leads_on_or_back_to_the_best_order(seed):
    world = MadeUp(seed)
    free = world.open(frozenset())
    # One that can be picked at other looks is not a choice now, but may be the best after a failure.
    first = {k: Try(0.2 + 0.1 * k) for k in free[1:]}
    if not first:
        return
    valued = value_choices(world, frozenset(), tuple(world.prices), 10_000, first)
    best = world.least(frozenset())
    for k, tried in first.items():
        wanted = 1 + tried.p * world.least(frozenset({k})) + (1 - tried.p) * best
        assert wanted - 1e-9 <= valued.values[k].mean <= wanted + 0.061
        assert valued.values[k].low <= wanted <= valued.values[k].high
        assert valued.orders[k][0] == k
    assert set(valued.orders) == set(first)
    assert valued.values[free[0]].mean == pytest.approx(1 + best, abs=0.031)
    assert sum(world.prices.get(k, world.target_price) for k in valued.otherwise) == pytest.approx(
        best, abs=0.031
    )


def test_what_the_shown_look_alone_can_pick_is_a_choice():
    def peek(gone: frozenset[int]) -> Seen:
        easy = Price(1.0, 1.0, 1.0)
        return Seen({} if 1 in gone else {1: easy}, easy if {1, 2} & gone else None, 0.0)

    valued = value_choices(Told(peek), frozenset(), (1, 2), 100, {2: Try(0.5), 1: Try(1.0)})
    assert valued.values[1].mean == 2.0
    # Half the time the target follows, half the time the other one and the target.
    assert valued.values[2].mean == 1 + 0.5 * 1 + 0.5 * 2


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("most", [3, 5, 8])
def test_to_begin_with_another_pick_of_the_best_order_costs_nothing(seed, most):
    world = MadeUp(seed, n=7)
    first = world.first()
    valued = value_choices(world, frozenset(), tuple(world.prices), most, first)
    assert all(len(set(order)) == len(order) for order in (*valued.orders.values(), valued.otherwise))
    prices = world.prices | {TARGET_ID: world.target_price}
    best = sum(prices[k] for k in valued.otherwise)
    for k in set(valued.otherwise) & set(first) if best else ():
        assert valued.values[k].mean <= 1.0 + best - prices[k] + 1e-9


def test_a_pick_that_is_not_the_first_has_no_known_grasp():
    """Object 1 frees the target and has a sure grasp at the shown look, but a poor one at any other."""
    poor, free = Price(3.0, 2.9, 3.1), Price(1.0, 1.0, 1.0)

    def peek(gone: frozenset[int]) -> Seen:
        others = {k: p for k, p in {1: poor, 2: free}.items() if k not in gone}
        return Seen(others, free if 1 in gone else None, 0.0)

    for looks in (3, 100):
        valued = value_choices(Told(peek), frozenset(), (1, 2), looks, {1: Try(1.0), 2: Try(1.0)})
        assert valued.values[1].mean == 2.0
        assert valued.values[2].mean == 1.0 + 3.0 + 1.0


@pytest.mark.parametrize(("more", "rest"), [({}, NEVER.mean), ({1: Price(2.0, 1.9, 2.1)}, 3.0)])
def test_what_holds_up_another_object_is_no_choice_that_costs_nothing(more, rest):
    """Object 2 holds up object 1: without it, 1 lies flat, and further draws alone may find a grasp of it."""
    free = Price(1.0, 1.0, 1.0)

    def seen(gone: frozenset[int]) -> Seen:
        others = {k: free for k in {1, 2} - gone if k != 1 or 2 not in gone}
        return Seen(others, free if 1 in gone else None, 0.0)

    valued = value_choices(Told(seen, more), frozenset(), (1, 2), 100, {1: Try(1.0), 2: Try(1.0)})
    assert valued.values[1].mean == 2.0
    assert valued.values[2].mean == 1.0 + rest
    assert valued.orders[2] == ((2, 1, TARGET_ID) if more else ())
