"""What it costs to remove an object, or to take the target, once other objects are gone."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64, UInt32, UInt64

from torc.records import GraspStatus, PlanningContext
from torc.task_planning.belief.settings import PriceConfig
from torc.task_planning.expected_picks import expected_picks
from torc.task_planning.graph import DependencyEdge, EdgeKind

LEAST_P = 0.05
"""No grasp is taken to be worse than this."""
UNREMOVABLE = 10.0
"""What it costs at most to clear an object away that no known grasp removes."""


@dataclass(frozen=True)
class Ways:
    """How an object can be grasped.

    Attributes:
        now: probability of the best grasp that is valid now; 0 where none is.
        blockers: the different sets of objects that block its grasps, as bits; 0 for valid ones. Grasps that are not
            valid for other reasons are left out: those held back as UNLIKELY are so after the next removal, too.
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
        """From (probability, blockers as bits) of each grasp."""
        grasps = list(grasps)
        p = np.array([max(row[0], LEAST_P) for row in grasps], dtype=float)
        sets, inverse = np.unique(np.array([row[1] for row in grasps], dtype=np.uint64), return_inverse=True)
        best = np.zeros(len(sets))
        np.maximum.at(best, inverse.ravel(), p)
        counts = np.bincount(inverse.ravel(), minlength=len(sets)).astype(np.int64)
        return cls(max(now, LEAST_P) if now else 0.0, sets, best, counts, on_it)

    def open_after(self, gone: UInt64[np.ndarray, "s"]) -> Bool[np.ndarray, "s g"]:
        """Which sets of blockers are gone with each set of objects."""
        return (self.blockers[None] & ~gone[:, None]) == 0

    def after(self, gone: UInt64[np.ndarray, "s"]) -> Float[np.ndarray, "s"]:
        """The best probability once these objects are gone; 0 where there is no grasp then."""
        return (self.open_after(gone) * self.best[None]).max(axis=1, initial=0.0)


def ways_of(context: PlanningContext, relations: Sequence[DependencyEdge]) -> dict[int, Ways]:
    """The ways to grasp each object in sight; `relations` tell what lies on it."""
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
    """Picks to remove each candidate after each set of candidates is gone (bit i for candidates[i]); infinite where
    it has no grasp then, or is gone. In the empty set only grasps that are valid now count.
    """
    gone = as_bits(masks, candidates)
    out = np.full((len(masks), len(candidates)), np.inf)
    for column, k in enumerate(candidates):
        p = np.where(masks == 0, ways[k].now, ways[k].after(gone))
        possible = (p > 0) & (masks >> np.uint32(column) & np.uint32(1) == 0)
        price = 1 / np.maximum(p, LEAST_P) if config.hold else np.ones(len(p))
        if not ways[k].now:
            price = price + _missing(ways[k], gone, config)
        out[:, column] = np.where(possible, price + config.dropped * _count(ways[k].on_it, gone), np.inf)
    return out


def clearing_costs(
    ways: Mapping[int, Ways], wanted: Sequence[int], gone: UInt64[np.ndarray, "s"], config: PriceConfig
) -> Float[np.ndarray, "s n"]:
    """Picks to remove each wanted object, and what blocks it, after each set of objects is gone (bit k for id k): by
    its cheapest grasp, each of whose blockers costs as much as by its own best one. A guess for what is not planned.
    """
    out = np.full((len(gone), len(wanted)), UNREMOVABLE)
    fees = {k: 1 / max(way.best.max(initial=0.0), LEAST_P) if config.hold else 1.0 for k, way in ways.items()}
    for column, k in enumerate(wanted):
        way = ways[k]
        if not len(way.best):
            continue
        left = way.blockers[None] & ~gone[:, None]
        price = np.tile(1 / way.best if config.hold else np.ones(len(way.best)), (len(gone), 1))
        for j, fee in fees.items():
            price += fee * ((left >> np.uint64(j)) & np.uint64(1))
        out[:, column] = np.minimum(price.min(axis=1), UNREMOVABLE)
    return out


def target_costs(
    way: Ways, candidates: Sequence[int], masks: UInt32[np.ndarray, "s"], picks_left: int, config: PriceConfig
) -> Float[np.ndarray, "s"]:
    """Picks to take a target in sight after each set of candidates is gone; infinite where it has no grasp then."""
    gone = as_bits(masks, candidates)
    p = np.where(masks == 0, way.now, way.after(gone))
    missing = np.where(masks == 0, 0.0, _missing(way, gone, config))
    left = np.maximum(picks_left - np.bitwise_count(masks).astype(int), 0)
    tries = [expected_picks(float(row), config.lost_share, int(picks)) for row, picks in zip(p, left)]
    return np.array(tries) + missing + config.loaded * _count(way.on_it, gone)


def _missing(way: Ways, gone: UInt64[np.ndarray, "s"], config: PriceConfig) -> Float[np.ndarray, "s"]:
    """The price of having counted on grasps that are blocked now: of few, none may be there in the end."""
    count = way.open_after(gone) @ way.counts
    return (1 - config.grasp_survives) ** count * config.fewest_grasps


def as_bits(masks: UInt32[np.ndarray, "s"], candidates: Sequence[int]) -> UInt64[np.ndarray, "s"]:
    """Sets of candidates (bit i for candidates[i]) with a bit k for object id k."""
    out = np.zeros(len(masks), np.uint64)
    for i, k in enumerate(candidates):
        out |= (masks.astype(np.uint64) >> np.uint64(i) & np.uint64(1)) << np.uint64(k)
    return out


def _count(bits: int, gone: UInt64[np.ndarray, "s"]) -> Int64[np.ndarray, "s"]:
    """How many of these objects are not gone."""
    return np.bitwise_count(np.uint64(bits) & ~gone).astype(np.int64)
