"""The search over removals, beside a plain enumeration of all orders."""

from itertools import permutations

import numpy as np
import pytest

from torc.task_planning.belief.costs import (
    UNREMOVABLE,
    Ways,
    as_bits,
    clearing_costs,
    expected_picks,
    opened_grasps,
    removal_costs,
    target_costs,
)
from torc.task_planning.belief.hiding import Belief
from torc.task_planning.belief.search import (
    TARGET_PICKS,
    Places,
    order_removals,
    places_of,
    plan_search,
    sets_up_to,
)
from torc.task_planning.belief.settings import HidingConfig, OpeningConfig, PriceConfig

NEVER = 0xFFFFFFFF
CERTAIN = PriceConfig(opening=OpeningConfig(0.0, (40.0, 0.0, 0.0), (0.0, 0.0, 1.0)), worth_waiting=0.0)


def random_places(rng: np.random.Generator, n: int, places: int) -> Places:
    points = rng.integers(0, 1 << n, (places, 27)) & rng.integers(0, 1 << n, (places, 27))
    points[points == 0] = NEVER
    weights = rng.random(places)
    bits = [rng.integers(0, 1 << n, places).astype(np.uint32) for _ in range(3)]
    return Places(
        weights / weights.sum(), points.astype(np.uint32), rng.integers(1, 20, places), *bits,
        found=rng.random(places) < 0.2, beyond=0.0,
    )  # fmt: skip


def price_of(order, places: Places, cost_of, clearing_of, prices: PriceConfig) -> float:
    """What an order of removals costs, step by step, by the words of the module alone."""
    gone, total = 0, 0.0
    shown = np.zeros(len(places.weights), bool)
    for k in order:
        cost, after = cost_of(gone, k), gone | 1 << k
        for i, weight in enumerate(places.weights):
            if shown[i]:
                continue
            own = cost + (prices.fallen if int(places.rests_on[i]) >> k & 1 else 0.0)
            clear = sum(int(mask) & ~after == 0 for mask in places.points[i])
            if clear >= places.needed[i]:
                shown[i] = True
                own += 0.0 if places.found[i] else fetching(places, i, after, clearing_of, prices)
            total += weight * own
        gone = after
    for i in np.flatnonzero(~shown):
        total += places.weights[i] * (
            prices.detour * straight_for(places, i, gone, clearing_of) + TARGET_PICKS
        )
    return total


def straight_for(places: Places, i: int, gone: int, clearing_of) -> float:
    """The price of clearing the cheapest points, as many as are needed."""
    points = [int(mask) for mask in places.points[i] if mask != NEVER]
    each = [sum(clearing_of(gone, k) for k in range(8) if mask & ~gone & 1 << k) for mask in points]
    return sorted(each)[: places.needed[i]][-1] if each else 0.0


def fetching(places: Places, i: int, gone: int, clearing_of, prices: PriceConfig) -> float:
    picks = TARGET_PICKS
    for k in range(5):
        if gone >> k & 1:
            continue
        fee = clearing_of(gone, k)
        if int(places.above[i]) >> k & 1:
            picks += fee
        elif int(places.front[i]) >> k & 1:
            picks += prices.still_blocking * fee
    return picks


@pytest.mark.parametrize("seed", range(6))
def test_the_order_is_the_cheapest_of_all(seed):
    rng = np.random.default_rng(seed)
    n, depth = 5, int(rng.integers(1, 4))
    places, sets = random_places(rng, n, 12), sets_up_to(n, depth)
    costs = rng.uniform(1, 3, (len(sets.masks), n))
    costs[rng.random(costs.shape) < 0.15] = np.inf
    costs[1:][~np.isfinite(costs[1:]).any(axis=1)] = 2.0
    clearing = rng.uniform(1, 4, costs.shape)
    prices = PriceConfig(fallen=0.7)
    number = {int(m): s for s, m in enumerate(sets.masks)}

    def cost_of(gone, k):
        return costs[number[gone], k]

    def clearing_of(gone, k):
        return clearing[number[gone], k]

    plan = plan_search(places, costs, clearing, sets, prices)
    orders = {o: price_of(o, places, cost_of, clearing_of, prices) for o in permutations(range(n), depth)}
    assert plan.price == pytest.approx(min(orders.values()), abs=1e-9)
    assert orders[plan.order] == pytest.approx(plan.price, abs=1e-9)
    for k in range(n):
        best = min(v for o, v in orders.items() if o[0] == k)
        assert plan.each[k] == pytest.approx(best, abs=1e-9) or np.isinf(best) == np.isinf(plan.each[k])


def test_a_dead_end_is_charged_for_what_is_still_hidden():
    points = np.array([[1] * 27, [2] * 27], dtype=np.uint32)
    none = np.zeros(2, np.uint32)
    places = Places(
        np.array([0.4, 0.6]), points, np.array([27, 27]), none, none, none, np.zeros(2, bool), 0.0
    )
    sets = sets_up_to(2, 2)
    costs = np.full((4, 2), np.inf)
    costs[0, 0] = 1.0
    plan = plan_search(places, costs, np.full((4, 2), 4.0), sets, PriceConfig(still_blocking=0.0, fallen=0.0))
    assert plan.order == (0,)
    assert plan.price == pytest.approx(1.0 + 0.4 * TARGET_PICKS + 0.6 * (1.5 * 4.0 + TARGET_PICKS), abs=1e-12)


def random_belief(rng: np.random.Generator, n: int) -> Belief:
    masks = (rng.integers(0, 1 << 8, (n, 27)) & rng.integers(0, 1 << 8, (n, 27))).astype(np.uint64)
    masks[: n // 2] = masks[: n // 2, :1]  # some places are alike
    hidden = rng.random((n, 27)) < 0.9
    masks[~hidden] = 0
    weights = rng.random(n)
    none = np.zeros(n, np.uint64)
    zeros = np.zeros((n, 64))
    return Belief(np.zeros((n, 8)), weights / weights.sum(), masks, hidden, zeros, none, none, n)


def test_places_that_are_merged_reveal_as_much_as_before():
    belief, candidates, config = random_belief(np.random.default_rng(1), 60), (5, 0, 3, 2), HidingConfig()
    places = places_of(belief, candidates, config)
    assert len(places.weights) < 60
    assert places.weights.sum() + places.beyond == pytest.approx(1.0, abs=1e-12)
    for gone in range(16):
        bits = sum(1 << k for i, k in enumerate(candidates) if gone >> i & 1)
        shown = 0.0
        for weight, row, hidden in zip(belief.weights, belief.masks, belief.hidden):
            clear = sum(bool(h) and m > 0 and int(m) & ~bits == 0 for m, h in zip(row, hidden))
            shown += weight * (clear >= max(np.ceil(config.reveal_share * hidden.sum() - 1e-9), 1))
        found = places.weights @ places.revealed(np.array([gone], dtype=np.uint32))[:, 0]
        assert found == pytest.approx(shown, abs=1e-9)


def test_a_suspect_is_found_by_its_own_removal():
    belief = random_belief(np.random.default_rng(2), 30)
    places = places_of(belief, (1, 6), HidingConfig(), {6: 0.3, 7: 0.1})
    shown = places.revealed(np.array([0b10], dtype=np.uint32))[:, 0]
    assert places.weights[places.found] == pytest.approx([0.3])
    assert shown[places.found].all()
    assert places.weights.sum() + places.beyond == pytest.approx(1.0)


def ways(now: float, *grasps: tuple[float, int], on_it: int = 0) -> Ways:
    return Ways.of(now, grasps, on_it)


def cheapest(target: Ways, others: dict[int, Ways], candidates, config=CERTAIN, picks_left: int = 10):
    sets = sets_up_to(len(candidates), 3)
    steps = removal_costs(others, candidates, sets.masks, config)
    plan = order_removals(steps, target_costs(target, candidates, sets.masks, picks_left, config), sets)
    return tuple(candidates[i] for i in plan.order), plan.price


def test_a_grasp_that_two_objects_block_needs_both_gone():
    """DG-SELECT counts 1 and 2 for two grasps each, 3 for one; but 3 alone frees the target."""
    others = {k: ways(1.0, (1.0, 0)) for k in (1, 2, 3)}
    target = ways(0.0, (0.9, 0b0110), (0.9, 0b0110), (0.9, 0b1000))
    order, price = cheapest(target, others, (1, 2, 3))
    assert order == (3,)
    assert price == pytest.approx(1.0 + expected_picks(0.9, CERTAIN.lost_share, 9), abs=1e-12)
    both, _ = cheapest(ways(0.0, (0.9, 0b0110)), others, (1, 2, 3))
    assert set(both) == {1, 2}


def test_an_object_is_removed_after_what_blocks_it_or_lies_on_it():
    others = {1: ways(0.0, (0.8, 0b100)), 2: ways(1.0, (1.0, 0))}
    assert cheapest(ways(0.0, (0.9, 0b10)), others, (1, 2))[0] == (2, 1)
    others = {1: ways(1.0, (1.0, 0), on_it=0b100), 2: ways(1.0, (1.0, 0))}
    assert cheapest(ways(0.0, (0.9, 0b10)), others, (1, 2))[0] == (2, 1)


@pytest.mark.parametrize(("p", "waits"), [(0.95, False), (0.5, True)])
def test_a_doubtful_target_waits_for_a_better_grasp(p, waits):
    """Breaks even where clearing costs as much as the risk of losing it with ten picks left."""
    target, others = ways(p, (p, 0), (0.97, 0b10)), {1: ways(1.0, (1.0, 0))}
    order, price = cheapest(target, others, (1,))
    now = expected_picks(p, CERTAIN.lost_share, 10)
    later = 1.0 + expected_picks(0.97, CERTAIN.lost_share, 9)
    assert order == ((1,) if later < now else ())
    assert bool(order) == waits
    assert price == pytest.approx(min(now, later), abs=1e-12)


def test_clearing_an_object_counts_what_blocks_its_cheapest_grasp():
    others = {1: ways(0.0, (0.5, 0b100), (0.8, 0b1100)), 2: ways(0.5, (0.5, 0)), 3: ways(0.0)}
    masks = sets_up_to(2, 2).masks
    costs = clearing_costs(others, (1, 2), as_bits(masks, (1, 2)), CERTAIN)
    by_one, by_both = 1 / 0.5 + 1 / 0.5, 1 / 0.8 + 1 / 0.5 + UNREMOVABLE
    assert costs[0, 0] == pytest.approx(min(by_one, by_both))
    assert costs[list(masks).index(0b10), 0] == pytest.approx(1 / 0.5)
    assert clearing_costs(others, (3,), np.zeros(1, np.uint64), CERTAIN)[0, 0] == UNREMOVABLE


def test_the_more_grasps_are_opened_the_surer_one_is_there():
    counts, best = np.array([0.0, 1.0, 3.0, 30.0]), np.array([0.0, 0.4, 0.4, 0.4])
    there, holds = opened_grasps(counts, best, OpeningConfig())
    assert there[0] == holds[0] == 0.0
    assert (np.diff(there) > 0).all()
    assert there[-1] < 1
    # A grasp is scored with the clutter around it, so it holds better once that is gone.
    assert (holds[1:] > best[1:]).all()
    assert (holds < 1).all()


def test_removals_never_make_a_grasp_worse_that_is_there_now():
    way = ways(0.7, (0.7, 0), (0.1, 0b10), (0.9, 0b1100))
    gone = np.array([0, 0b10, 0b100, 0b1100, 0b1110], dtype=np.uint64)
    there, holds = way.after(gone, OpeningConfig())
    assert (there == 1).all()
    assert holds[0] == holds[2] == pytest.approx(0.7)
    assert (holds >= 0.7).all()
    assert holds[4] >= holds[3] > 0.7


def test_a_doubtful_opening_costs_more():
    gone = np.array([0, 0b10], dtype=np.uint32)
    prices = [
        removal_costs(
            {3: ways(0.0, *[(0.3, 0b100)] * n), 2: ways(1.0, (1.0, 0))}, (3, 2), gone, PriceConfig()
        )[1, 0]
        for n in (1, 5, 40)
    ]
    assert prices[0] > prices[1] > prices[2] > 1


def test_what_shows_nothing_is_not_removed_before_the_way_to_what_does():
    """2 hides all of it, but is blocked by 1; 3 and 4 are easily removed, to no effect."""
    others = {
        1: ways(0.6, (0.6, 0)),
        2: ways(0.0, (0.6, 0b10)),
        3: ways(1.0, (1.0, 0)),
        4: ways(1.0, (1.0, 0)),
    }
    masks = np.full((10, 27), 1 << 2, dtype=np.uint64)
    none, zeros = np.zeros(10, np.uint64), np.zeros((10, 64))
    belief = Belief(np.zeros((10, 8)), np.full(10, 0.1), masks, masks > 0, zeros, none, none, 10)
    candidates, sets = (2, 1, 3, 4), sets_up_to(4, 1)
    places = places_of(belief, candidates, HidingConfig())
    costs = removal_costs(others, candidates, sets.masks, PriceConfig())
    clearing = clearing_costs(others, candidates, as_bits(sets.masks, candidates), PriceConfig())
    plan = plan_search(places, costs, clearing, sets, PriceConfig())
    assert candidates[plan.order[0]] == 1
