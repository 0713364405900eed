"""Price the removal of an object, or of the target, once other objects are gone, and name what is in its way."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64, UInt32, UInt64
from numpy.typing import ArrayLike

from torc.records import GraspStatus, PlanningContext
from torc.records.graph import DependencyEdge, EdgeKind
from torc.task_planning.belief.settings import OpeningConfig, PriceConfig

LEAST_P = 0.05
"""Lower limit of a grasp's probability."""
_MOST_P = 0.98
_FEW = 0.05
"""Keeps the logarithm finite when there are no grasps."""
UNREMOVABLE = 10.0
"""Upper limit of the price, in picks, of clearing away an object that no known grasp removes."""


@dataclass(frozen=True)
class Ways:
    """How an object can be grasped.

    Attributes:
        now: probability of the best grasp that is valid now; 0 if there is none.
        blockers: the different sets of objects that block its grasps, as bits; 0 for valid grasps. Grasps that are
            invalid for other reasons are left out: those held back as UNLIKELY stay so after the next removal.
        best: the best probability among the grasps that each set blocks.
        counts: how many grasps each set blocks.
        on_it: bits of the objects that lie on it.
    """

    now: float
    blockers: UInt64[np.ndarray, "g"]
    best: Float[np.ndarray, "g"]
    counts: Int64[np.ndarray, "g"]
    on_it: int = 0

    @classmethod
    def of(cls, now: float, grasps: Iterable[tuple[float, int]], on_it: int = 0) -> "Ways":
        """Build from (probability, blockers as bits) of each grasp."""
        grasps = list(grasps)
        p = np.array([max(row[0], LEAST_P) for row in grasps], dtype=float)
        sets, inverse = np.unique(np.array([row[1] for row in grasps], dtype=np.uint64), return_inverse=True)
        best = np.zeros(len(sets))
        np.maximum.at(best, inverse.ravel(), p)
        counts = np.bincount(inverse.ravel(), minlength=len(sets)).astype(np.int64)
        return cls(max(now, LEAST_P) if now else 0.0, sets, best, counts, on_it)

    def after(
        self, gone: UInt64[np.ndarray, "s"], opening: OpeningConfig
    ) -> tuple[Float[np.ndarray, "s"], Float[np.ndarray, "s"]]:
        """Return the probability of a valid grasp once `gone` is gone, and of the best one holding; 0 if unknown."""
        blocked = self.blockers != 0
        left = np.bitwise_count(self.blockers[blocked][None] & ~gone[:, None])
        nearly = opening.nearly ** left.astype(float) @ self.counts[blocked]
        best = ((left == 0) * self.best[blocked][None]).max(axis=1, initial=0.0)
        there, holds = opened_grasps(nearly, best, opening)
        if not self.now:
            return there, holds
        return np.ones(len(gone)), self.now + there * np.maximum(holds - self.now, 0.0)


def opened_grasps(
    nearly: Float[np.ndarray, "*s"], best: Float[np.ndarray, "*s"], config: OpeningConfig
) -> tuple[Float[np.ndarray, "*s"], Float[np.ndarray, "*s"]]:
    """Return the probability that blocked grasps leave a valid one, and that it then holds; 0 without grasps.

    `nearly` is s of `OpeningConfig`; `best` is the probability of the best grasp that nothing blocks any more.
    """
    number = np.log(nearly + _FEW)
    a, b, c = config.there
    there = 1 / (1 + np.exp(-(a + b * number + c * best)))
    a, b, c = config.holds
    holds = np.clip(a + b * number + c * best, LEAST_P, _MOST_P)
    return np.where(nearly > 0, there, 0.0), np.where(nearly > 0, holds, 0.0)


def ways_of(context: PlanningContext, relations: Sequence[DependencyEdge]) -> dict[int, Ways]:
    """Return the ways to grasp each object in sight; `relations` say what lies on it."""
    grasps, report = context.grasps, context.report
    in_sight = sum(1 << k for k in context.scene.ids)
    on_it = dict.fromkeys(context.scene.ids, 0)
    for r in relations:
        if r.kind == EdgeKind.BELOW:
            on_it[r.source] |= 1 << r.target
    out = {}
    for k in context.scene.ids:
        of = np.flatnonzero(grasps.object_ids == k)
        status, score, by = report.status[of], grasps.scores[of], report.blockers[of]
        valid = score[status == GraspStatus.VALID]
        blocked = status == GraspStatus.BLOCKED
        usable = (status == GraspStatus.VALID) | (blocked & (by != 0) & ((by & ~np.uint64(in_sight)) == 0))
        rows = zip(score[usable].tolist(), np.where(blocked, by, np.uint64(0))[usable].tolist())
        out[k] = Ways.of(float(valid.max(initial=0.0)), rows, on_it[k])
    return out


def removal_costs(
    ways: Mapping[int, Ways],
    candidates: Sequence[int],
    masks: UInt32[np.ndarray, "s"],
    config: PriceConfig,
) -> Float[np.ndarray, "s n"]:
    """Return the picks to remove each candidate after each set of candidates is gone (bit i for candidates[i]).

    Infinite if it then has no grasp, or is gone. In the empty set only grasps that are valid now count.
    """
    gone = as_bits(masks, candidates)
    out = np.full((len(masks), len(candidates)), np.inf)
    for column, k in enumerate(candidates):
        there, after = ways[k].after(gone, config.opening)
        p = np.where(masks == 0, ways[k].now, after)
        possible = (p > 0) & (masks >> np.uint32(column) & np.uint32(1) == 0)
        price = _tries(p, config) + _missing(there, config)
        out[:, column] = np.where(possible, price + config.dropped * _count(ways[k].on_it, gone), np.inf)
    return out


def clearing_costs(
    ways: Mapping[int, Ways], wanted: Sequence[int], gone: UInt64[np.ndarray, "s"], config: PriceConfig
) -> Float[np.ndarray, "s n"]:
    """Estimate the picks to remove each wanted object, and what blocks it, after each set (bit k for id k) is gone.

    It takes the cheapest grasp; each blocker costs as much as its own best grasp. A guess for what is not planned.
    """
    out = np.full((len(gone), len(wanted)), UNREMOVABLE)
    by_set = {k: _price_by_set(way, config) for k, way in ways.items()}
    fees = {k: float(prices.min(initial=UNREMOVABLE)) for k, prices in by_set.items()}
    for column, k in enumerate(wanted):
        way = ways[k]
        if not len(way.best):
            continue
        left = way.blockers[None] & ~gone[:, None]
        price = np.tile(by_set[k], (len(gone), 1))
        for j, fee in fees.items():
            price += fee * ((left >> np.uint64(j)) & np.uint64(1))
        out[:, column] = np.minimum(price.min(axis=1), UNREMOVABLE)
    return out


def target_costs(
    way: Ways, candidates: Sequence[int], masks: UInt32[np.ndarray, "s"], picks_left: int, config: PriceConfig
) -> Float[np.ndarray, "s"]:
    """Return the picks to take a target in sight after each set of candidates is gone; infinite without a grasp."""
    gone = as_bits(masks, candidates)
    there, after = way.after(gone, config.opening)
    p = np.where(masks == 0, way.now, after)
    missing = np.where(masks == 0, 0.0, _missing(there, config))
    left = np.maximum(picks_left - np.bitwise_count(masks).astype(int), 0)
    return expected_picks(p, config.lost_share, left) + missing + config.loaded * _count(way.on_it, gone)


def _price_by_set(way: Ways, config: PriceConfig) -> Float[np.ndarray, "g"]:
    """Return the picks to remove an object by the grasps that each set blocks, once that set is gone."""
    there, holds = way.after(way.blockers, config.opening)
    free = way.blockers == 0
    return np.where(free, _tries(way.best, config), _tries(holds, config) + _missing(there, config))


def _missing(there: Float[np.ndarray, "*s"], config: PriceConfig) -> Float[np.ndarray, "*s"]:
    """Return the extra picks until a grasp exists, if each further removal gives an equal chance."""
    return np.minimum(config.missing * (1 - there) / np.maximum(there, LEAST_P), UNREMOVABLE)


def _tries(p: Float[np.ndarray, "*s"], config: PriceConfig) -> Float[np.ndarray, "*s"]:
    return 1 / np.maximum(p, LEAST_P) if config.hold else np.ones(p.shape)


def as_bits(masks: UInt32[np.ndarray, "s"], candidates: Sequence[int]) -> UInt64[np.ndarray, "s"]:
    """Convert sets of candidates (bit i for candidates[i]) to sets of object ids (bit k for id k)."""
    out = np.zeros(len(masks), np.uint64)
    for i, k in enumerate(candidates):
        out |= (masks.astype(np.uint64) >> np.uint64(i) & np.uint64(1)) << np.uint64(k)
    return out


def _count(bits: int, gone: UInt64[np.ndarray, "s"]) -> Int64[np.ndarray, "s"]:
    """Count the objects that are not gone."""
    return np.bitwise_count(np.uint64(bits) & ~gone).astype(np.int64)


def expected_picks(p: ArrayLike, lost_share: float, picks_left: ArrayLike) -> Float[np.ndarray, "*s"]:
    """Return the expected number of picks to get an object out by a grasp that succeeds with probability p; infinite
    for p = 0.

    With q the share of failed tries that lose the object, and with it all picks that are left:
        cost(p) = tries + lost * picks_left,  tries = 1 / (p + q (1 - p)),  lost = q (1 - p) * tries
    """
    comes = np.where(np.asarray(p) > 0, p, 1.0)
    goes = lost_share * (1 - comes)
    return np.where(np.asarray(p) > 0, (1 + goes * np.asarray(picks_left)) / (comes + goes), np.inf)


def with_obstacles(wanted: Sequence[int], ways: dict[int, Ways], most: int) -> tuple[int, ...]:
    """Return up to `most` objects: each wanted one, followed by what lies on it or must go before it can be grasped.

    This is applied recursively. Blockers of the grasps with the fewest blockers come first.
    """
    chosen: list[int] = []
    waiting = list(reversed(wanted))
    while waiting and len(chosen) < most:
        k = waiting.pop()
        if k in chosen or k not in ways:
            continue
        chosen.append(k)
        waiting += reversed(_obstacles(ways[k], ways))
    return tuple(chosen)


def _obstacles(way: Ways, ways: dict[int, Ways]) -> list[int]:
    """Return what lies on an object and, if it has no grasp now, what blocks its grasps."""
    found = [k for k in ways if way.on_it >> k & 1]
    if way.now:
        return found
    sets = zip(way.best.tolist(), way.blockers.tolist())
    for _, _, bits in sorted((b.bit_count(), -p, b) for p, b in sets if b):
        found += [k for k in ways if bits >> k & 1 and k not in found]
    return found
