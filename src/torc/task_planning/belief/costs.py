"""What it costs to remove an object, or to take the target, once other objects are gone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.records import GraspStatus, PlanningContext
from torc.task_planning.belief.settings import PriceConfig
from torc.task_planning.expected_picks import expected_picks
from torc.task_planning.graph import DependencyEdge, EdgeKind

LEAST_P = 0.05
"""No grasp is taken to be worse than this."""
_USABLE = GraspStatus.VALID, GraspStatus.BLOCKED, GraspStatus.UNLIKELY


@dataclass(frozen=True)
class Ways:
    """How an object can be grasped: probabilities, and per grasp the objects that must be gone first, as bits.

    Attributes:
        now: probability of the best grasp that is valid now; 0 where none is.
        scores, blockers: of its grasps that are valid, held back, or only blocked by objects in sight.
        on_it: bits of the objects that lie on it.
    """

    now: float
    scores: tuple[float, ...]
    blockers: tuple[int, ...]
    on_it: int = 0

    def after(self, gone: int) -> tuple[float, int]:
        """The best probability once these objects are gone, and the number of grasps that there are then."""
        open_now = [p for p, b in zip(self.scores, self.blockers) if b & ~gone == 0]
        return max(open_now, default=0.0), len(open_now)

    @property
    def best(self) -> float:
        """The best probability if everything in the way were gone."""
        return max(self.scores, default=0.0)


def ways_of(context: PlanningContext, relations: Sequence[DependencyEdge]) -> dict[int, Ways]:
    """The ways to grasp each object in sight; `relations` tell what lies on it."""
    grasps, report = context.grasps, context.report
    seen_bits = sum(1 << k for k in context.scene.ids)
    on_it = dict.fromkeys(context.scene.ids, 0)
    for r in relations:
        if r.kind == EdgeKind.BELOW:
            on_it[r.source] |= 1 << r.target
    out = {}
    for k in context.scene.ids:
        of = np.flatnonzero(grasps.object_ids == k)
        status, score, by = report.status[of], grasps.scores[of], report.blockers[of]
        rows = [
            (max(float(p), LEAST_P), int(b) if s == GraspStatus.BLOCKED else 0)
            for s, p, b in zip(status.tolist(), score.tolist(), by.tolist())
            if s in _USABLE and not (s == GraspStatus.BLOCKED and (b == 0 or b & ~seen_bits))
        ]
        valid = score[status == GraspStatus.VALID]
        now = max(float(valid.max()), LEAST_P) if len(valid) else 0.0
        out[k] = Ways(now, tuple(p for p, _ in rows), tuple(b for _, b in rows), on_it[k])
    return out


def removal_costs(
    ways: dict[int, Ways],
    candidates: Sequence[int],
    sets: Sequence[int],
    config: PriceConfig,
) -> Float[np.ndarray, "s n"]:
    """Picks to remove each candidate after each set of candidates is gone (bit i for candidates[i]); infinite where
    it has no grasp then. In the first set, which must be empty, only grasps that are valid now count.
    """
    out = np.full((len(sets), len(candidates)), np.inf)
    for row, members in enumerate(sets):
        gone = as_bits(members, candidates)
        for column, k in enumerate(candidates):
            if members >> column & 1:
                continue
            p = ways[k].now if members == 0 else ways[k].after(gone)[0]
            if p > 0:
                on_it = (ways[k].on_it & ~gone).bit_count()
                out[row, column] = (1 / p if config.hold else 1.0) + config.dropped * on_it
    return out


def target_costs(
    way: Ways, candidates: Sequence[int], sets: Sequence[int], picks_left: int, config: PriceConfig
) -> Float[np.ndarray, "s"]:
    """Picks to take a target in sight after each set of candidates is gone; infinite where it has no grasp then."""
    out = np.full(len(sets), np.inf)
    for row, members in enumerate(sets):
        gone = as_bits(members, candidates)
        p, count = (way.now, 0) if members == 0 else way.after(gone)
        if p > 0:
            left = max(picks_left - members.bit_count(), 0)
            missing = 0.0 if members == 0 else (1 - config.grasp_survives) ** count * config.fewest_grasps
            on_it = (way.on_it & ~gone).bit_count()
            out[row] = expected_picks(p, config.lost_share, left) + missing + config.loaded * on_it
    return out


def as_bits(members: int, candidates: Sequence[int]) -> int:
    """A set of candidates (bit i for candidates[i]) with a bit k for object id k."""
    return sum(1 << k for i, k in enumerate(candidates) if members >> i & 1)
