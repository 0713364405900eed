"""Find the order of removals with the fewest expected picks, by dynamic programming over sets of removed objects.

What a set of removals reveals does not depend on their order, so a state is the set S of objects that are gone:

    V(S) = min over k of  c(k, S) W(S) + sum over i of w_i togo_i(S + k) + V(S + k)

c(k, S) is the cost of removing k then, W(S) the weight of the places that S does not reveal; i are the places that S +
k reveals and S does not, w_i their weights, togo_i the picks to fetch the target from there. After `depth` removals, a
place that is still hidden costs an estimate of clearing it, times a detour.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int64, UInt32

from torc.task_planning.belief.hiding import Belief
from torc.task_planning.belief.search_kernels import (
    best_order,
    picks_after,
    prices_to_reveal,
    revealed_by,
    step_prices,
)
from torc.task_planning.belief.settings import HidingConfig, PriceConfig

TARGET_PICKS = 1.1
"""Picks to take the target once it can be grasped."""
_NEVER = np.uint32(0xFFFFFFFF)


@dataclass(frozen=True)
class Sets:
    """All sets of up to `depth` of n candidates, the smaller ones first.

    Attributes:
        masks: bit i for candidate i; the first set is empty.
        following: number of the set with one candidate more; -1 if that is too large or already has it.
    """

    masks: UInt32[np.ndarray, "s"]
    following: Int64[np.ndarray, "s n"]


def sets_up_to(n: int, depth: int) -> Sets:
    """Return the sets of up to `depth` of n candidates."""
    members = [
        sum(1 << i for i in chosen)
        for size in range(min(depth, n) + 1)
        for chosen in combinations(range(n), size)
    ]
    number = {mask: s for s, mask in enumerate(members)}
    following = np.full((len(members), n), -1, np.int64)
    for s, mask in enumerate(members):
        for k in range(n):
            if not mask >> k & 1:
                following[s, k] = number.get(mask | 1 << k, -1)
    return Sets(np.array(members, dtype=np.uint32), following)


@dataclass(frozen=True)
class Places:
    """Places of a hidden target as the search sees them; those that the same removals reveal are merged.

    Attributes:
        weights: their shares of the belief; sum to 1 with `beyond`.
        points: per point the candidates that hide it; all bits set if it does not count or something else hides it.
        needed: how many points have to come into sight.
        above, front, rests_on: candidates that lie above, that hide much of it, and that it rests on.
        found: the removal itself fetches the target: an object in sight may be it.
        beyond: share of the belief that no removal of candidates reveals.
    """

    weights: Float[np.ndarray, "c"]
    points: UInt32[np.ndarray, "c 27"]
    needed: Int64[np.ndarray, "c"]
    above: UInt32[np.ndarray, "c"]
    front: UInt32[np.ndarray, "c"]
    rests_on: UInt32[np.ndarray, "c"]
    found: Bool[np.ndarray, "c"]
    beyond: float

    def revealed(self, masks: UInt32[np.ndarray, "s"]) -> Bool[np.ndarray, "c s"]:
        """Return which places each set reveals."""
        return revealed_by(self.points, self.needed, masks)


def places_of(
    belief: Belief,
    candidates: Sequence[int],
    config: HidingConfig,
    suspects: dict[int, float] | None = None,
) -> Places:
    """Express the belief in candidates; `suspects` are the probabilities that a candidate is itself the target."""
    suspects = {k: p for k, p in (suspects or {}).items() if k in candidates}
    scale = max(1 - sum(suspects.values()), 0.0)
    count = belief.hidden.sum(axis=1)
    points = np.where(belief.hidden, compress(belief.masks, candidates, others=True), _NEVER)
    points[belief.masks == 0] = _NEVER
    needed = np.maximum(np.ceil(config.reveal_share * count - 1e-9), 1).astype(np.int64)
    front = np.zeros(len(belief), np.uint32)
    for i, k in enumerate(candidates):
        hidden_points = ((belief.masks >> np.uint64(k)) & np.uint64(1)).sum(axis=1)
        front |= np.where(hidden_points >= config.front_share * np.maximum(count, 1), 1 << i, 0).astype(
            np.uint32
        )
    columns = [
        np.sort(points, axis=1),
        needed.astype(np.uint32)[:, None],
        compress(belief.above, candidates)[:, None],
        front[:, None],
        compress(belief.rests_on, candidates)[:, None],
        np.zeros((len(belief), 1), np.uint32),
    ]
    rows, weights = np.concatenate(columns, axis=1), scale * belief.weights
    for k, p in suspects.items():
        bit = 1 << list(candidates).index(k)
        rows = np.concatenate([rows, np.array([[bit] * 27 + [27, 0, 0, 0, 1]], dtype=np.uint32)])
        weights = np.append(weights, p)
    everything = np.array([(1 << len(candidates)) - 1], dtype=np.uint32)
    possible = revealed_by(np.ascontiguousarray(rows[:, :27]), rows[:, 27].astype(np.int64), everything)[:, 0]
    kept, inverse = np.unique(rows[possible], axis=0, return_inverse=True)
    summed = np.bincount(inverse.ravel(), weights[possible], minlength=len(kept)).astype(float)
    above, front, rests_on, found = (np.ascontiguousarray(kept[:, 28 + c]) for c in range(4))
    return Places(
        weights=summed,
        points=np.ascontiguousarray(kept[:, :27]),
        needed=kept[:, 27].astype(np.int64),
        above=above,
        front=front,
        rests_on=rests_on,
        found=found > 0,
        beyond=float(weights[~possible].sum()),
    )


def compress(masks: np.ndarray, candidates: Sequence[int], others: bool = False) -> np.ndarray:
    """Convert 64-bit masks of object ids to 32-bit masks of candidates.

    With `others`, all bits are set where another id is.
    """
    out = np.zeros(masks.shape, np.uint32)
    rest = masks.copy()
    for i, k in enumerate(candidates):
        bit = np.uint64(1) << np.uint64(k)
        out |= ((masks >> np.uint64(k)) & np.uint64(1)).astype(np.uint32) << np.uint32(i)
        rest &= ~bit
    if others:
        out[rest != 0] = _NEVER
    return out


@dataclass(frozen=True)
class Plan:
    """The result of the search.

    Attributes:
        order: the removals, as numbers of candidates, until something comes into sight.
        price: expected price from now on, in picks times weight; infinite if nothing can be done.
        each: the price of each first removal; infinite if it cannot be done.
    """

    order: tuple[int, ...]
    price: float
    each: Float[np.ndarray, "n"]


def order_removals(steps: Float[np.ndarray, "s n"], stop: Float[np.ndarray, "s"], sets: Sets) -> Plan:
    """Return the cheapest order; `stop` is the price, by set, of removing nothing more."""
    value, choice, each = best_order(steps, stop, sets.following)
    order, at = [], 0
    while choice[at] >= 0:
        order.append(int(choice[at]))
        at = int(sets.following[at, choice[at]])
    return Plan(tuple(order), float(value[0]), each[0])


def plan_search(
    places: Places,
    costs: Float[np.ndarray, "s n"],
    clearing: Float[np.ndarray, "s n"],
    sets: Sets,
    prices: PriceConfig,
) -> Plan:
    """Plan the order of removals for a hidden target.

    Args:
        costs: by set and candidate; infinite if it cannot be done then.
        clearing: final cost of each candidate, with all that is in the way.
    """
    revealed = places.revealed(sets.masks)
    base_still = np.array([TARGET_PICKS, prices.still_blocking])
    togo = picks_after(places.above, places.front, sets.masks, clearing, base_still)
    togo[places.found] = 0.0
    steps = step_prices(places.weights, revealed, togo, places.rests_on, costs, sets.following, prices.fallen)
    at_end = ~np.isfinite(steps).any(axis=1)
    hidden_at_end = ~revealed & at_end[None]
    direct = prices_to_reveal(places.points, places.needed, sets.masks, clearing, hidden_at_end)
    outlook = places.weights @ (hidden_at_end * (prices.detour * direct + TARGET_PICKS))
    return order_removals(steps, np.where(at_end, outlook, np.inf), sets)
