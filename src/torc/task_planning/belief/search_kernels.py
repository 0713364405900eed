"""Compiled parts of the search over sets of removed objects; a set of candidates is a 32-bit mask.

Every integer that is used as a mask is kept unsigned: numba turns a mixture of int64 and uint64 into floats.
"""

import numpy as np
from jaxtyping import Bool, Float, Int64, UInt32
from numba import njit

_ZERO, _ONE = np.uint32(0), np.uint32(1)


@njit(cache=True)
def revealed_by(
    points: UInt32[np.ndarray, "c p"], needed: Int64[np.ndarray, "c"], sets: UInt32[np.ndarray, "s"]
) -> Bool[np.ndarray, "c s"]:
    """Check whether each place comes into sight once a set is gone: nothing else hides enough of its points."""
    out = np.zeros((points.shape[0], sets.shape[0]), np.bool_)
    for c in range(points.shape[0]):
        for s in range(sets.shape[0]):
            count = 0
            for p in range(points.shape[1]):
                if points[c, p] & ~sets[s] == _ZERO:
                    count += 1
                    if count >= needed[c]:
                        out[c, s] = True
                        break
    return out


@njit(cache=True)
def picks_after(
    above: UInt32[np.ndarray, "c"],
    front: UInt32[np.ndarray, "c"],
    sets: UInt32[np.ndarray, "s"],
    fees: Float[np.ndarray, "s n"],
    base_still: Float[np.ndarray, "2"],
) -> Float[np.ndarray, "c s"]:
    """Return the picks to fetch the target from each place once it is in sight and a set is gone.

    They are the price of the target itself (`base_still[0]`), the fee of each object that still lies above it, and the
    share `base_still[1]` of the fee of each that stands in front of it.
    """
    out = np.full((above.shape[0], sets.shape[0]), base_still[0])
    for c in range(above.shape[0]):
        for s in range(sets.shape[0]):
            for k in range(fees.shape[1]):
                bit = _ONE << np.uint32(k)
                if sets[s] & bit != _ZERO:
                    continue
                if above[c] & bit != _ZERO:
                    out[c, s] += fees[s, k]
                elif front[c] & bit != _ZERO:
                    out[c, s] += base_still[1] * fees[s, k]
    return out


@njit(cache=True)
def prices_to_reveal(
    points: UInt32[np.ndarray, "c p"],
    needed: Int64[np.ndarray, "c"],
    sets: UInt32[np.ndarray, "s"],
    clearing: Float[np.ndarray, "s n"],
    wanted: Bool[np.ndarray, "c s"],
) -> Float[np.ndarray, "c s"]:
    """Return, where `wanted`, the price of bringing a place into sight once a set is gone; 0 elsewhere.

    It is the price of clearing away all that hides a point of the place, for the cheapest `needed` points. Only points
    that candidates alone hide can be cleared. Points with equal masks are adjacent, so each price is computed once.
    """
    out = np.zeros(wanted.shape)
    price, count = np.empty(points.shape[1]), np.empty(points.shape[1], np.int64)
    beyond = _ONE << np.uint32(clearing.shape[1])
    for c in range(points.shape[0]):
        for s in range(sets.shape[0]):
            if not wanted[c, s]:
                continue
            kinds = 0
            for p in range(points.shape[1]):
                if points[c, p] >= beyond:
                    continue
                if p > 0 and points[c, p] == points[c, p - 1]:
                    count[kinds - 1] += 1
                    continue
                price[kinds], count[kinds] = 0.0, 1
                for k in range(clearing.shape[1]):
                    if points[c, p] & ~sets[s] & (_ONE << np.uint32(k)) != _ZERO:
                        price[kinds] += clearing[s, k]
                kinds += 1
            left, most = needed[c], 0.0
            while left > 0 and kinds > 0:
                least = 0
                for i in range(1, kinds):
                    if price[i] < price[least]:
                        least = i
                most = price[least]
                left -= count[least]
                kinds -= 1
                price[least], count[least] = price[kinds], count[kinds]
            out[c, s] = most
    return out


@njit(cache=True)
def step_prices(
    weights: Float[np.ndarray, "c"],
    revealed: Bool[np.ndarray, "c s"],
    togo: Float[np.ndarray, "c s"],
    rests_on: UInt32[np.ndarray, "c"],
    costs: Float[np.ndarray, "s n"],
    following: Int64[np.ndarray, "s n"],
    fallen: float,
) -> Float[np.ndarray, "s n"]:
    """Return the price of each removal after each set is gone, weighted by the belief that is still hidden.

    It sums the removal's cost, the price `fallen` for the places that rest on the object, and the picks to take the
    target from the places that it reveals. `following` is the number of the set with the object, -1 if the search stops
    there.
    """
    n_sets, n = costs.shape
    out = np.full((n_sets, n), np.inf)
    for s in range(n_sets):
        for k in range(n):
            after = following[s, k]
            if after < 0 or costs[s, k] == np.inf:
                continue
            bit, price = _ONE << np.uint32(k), 0.0
            for c in range(weights.shape[0]):
                if revealed[c, s]:
                    continue
                own = costs[s, k]
                if rests_on[c] & bit != _ZERO:
                    own += fallen
                if revealed[c, after]:
                    own += togo[c, after]
                price += weights[c] * own
            out[s, k] = price
    return out


@njit(cache=True)
def best_order(
    steps: Float[np.ndarray, "s n"], stop: Float[np.ndarray, "s"], following: Int64[np.ndarray, "s n"]
) -> tuple[Float[np.ndarray, "s"], Int64[np.ndarray, "s"], Float[np.ndarray, "s n"]]:
    """Return the least price from each set on, the removal it begins with (-1: stop), and the price of each removal.

    V(S) = min(stop(S), min_k steps(S, k) + V(S + k)); sets are ordered by size, so V is found from the last one back.
    Of equal prices, stopping wins, then the removal of the lowest number.
    """
    n_sets, n = steps.shape
    value, choice = stop.copy(), np.full(n_sets, -1, np.int64)
    each = np.full((n_sets, n), np.inf)
    for s in range(n_sets - 1, -1, -1):
        for k in range(n):
            after = following[s, k]
            if after < 0:
                continue
            each[s, k] = steps[s, k] + value[after]
            if each[s, k] < value[s]:
                value[s], choice[s] = each[s, k], k
    return value, choice, each
