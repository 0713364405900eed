"""What is measured of a planner's completed trials, each with its interval."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf

from torc.benchmark.intervals import Estimate, by_problem, mean, median, share
from torc.benchmark.rows import PickRow, TrialRow

Rows = Sequence[TrialRow]
PROMISE_BINS = (0.0, 0.5, 0.8, 0.95, 0.98, 1.0)
"""Edges of the bins in which the promised probability is compared with what came of it."""


@dataclass(frozen=True)
class Measure:
    """A column of the tables.

    Attributes:
        name: its heading.
        help: what it says, in a sentence.
        of: from completed trials to a number.
        digits: after the point; None for two significant ones.
    """

    name: str
    help: str
    of: Callable[[Rows], Estimate]
    digits: int | None = 2


def _share(predicate: Callable[[TrialRow], bool]) -> Callable[[Rows], Estimate]:
    return lambda rows: share(
        *by_problem([r.problem for r in rows], [predicate(r) for r in rows], [1] * len(rows))
    )


def _mean(value: Callable[[TrialRow], float], bounded: bool = False) -> Callable[[Rows], Estimate]:
    """bounded: by the budget of picks."""

    def of(rows: Rows) -> Estimate:
        sums, totals = by_problem([r.problem for r in rows], [value(r) for r in rows], [1] * len(rows))
        return mean(sums, totals, max((r.max_picks for r in rows), default=inf) if bounded else inf)

    return of


def _median_of_picks(
    value: Callable[[PickRow], float], of_interest: Callable[[PickRow], bool] = lambda pick: True
) -> Callable[[Rows], Estimate]:
    def of(rows: Rows) -> Estimate:
        picks = [(r.problem, value(p)) for r in rows for p in r.picked if of_interest(p)]
        return median([name for name, _ in picks], [v for _, v in picks])

    return of


def _of_grasps(good: Callable[[PickRow], bool], unseen: bool = False) -> Callable[[Rows], Estimate]:
    """Share of the grasps that were carried out, of `unseen` kinds alone if so, that are good."""

    def of(rows: Rows) -> Estimate:
        picks = [(r.problem, p) for r in rows for p in r.picked if p.grasp_tried]
        tried = [(name, good(p)) for name, p in picks if p.unseen_kind or not unseen]
        return share(*by_problem([n for n, _ in tried], [g for _, g in tried], [1] * len(tried)))

    return of


SUCCESS = Measure(
    "retrieved", "the target was held after the lift and delivered", _share(lambda r: r.retrieved)
)
DROP_FREE = Measure(
    "with no drop", "and nothing else left the table", _share(lambda r: r.retrieved and r.drops == 0)
)
COST = Measure(
    "picks to retrieval",
    "mean; a trial that never retrieved the target counts as the whole budget: the paper's primary objective",
    _mean(lambda r: r.cost, bounded=True),
    1,
)
DROPS = Measure(
    "drops",
    "mean number of other objects dropped in a trial: the secondary objective",
    _mean(lambda r: r.drops),
)
MEDIAN_PICKS = Measure(
    "median picks",
    "of all completed trials",
    lambda rows: median([r.problem for r in rows], [r.picks for r in rows]),
    0,
)
MEAN_PICKS = Measure("mean picks", "of all completed trials", _mean(lambda r: r.picks, bounded=True), 1)
DECISION_S = Measure(
    "decision, s", "median time of one decision", _median_of_picks(lambda p: p.decision_s), None
)
PLANNING_S = Measure(
    "pick planning, s",
    "median time of planning a pick: grasps and motions, without the decision",
    _median_of_picks(lambda p: p.planning_s, lambda p: p.motions_s > 0),
)
GRASPS = Measure(
    "grasps held", "after the lift, of the grasps that were carried out", _of_grasps(lambda p: p.held)
)
DELIVERED = Measure("delivered", "put into the bin, of the same", _of_grasps(lambda p: p.delivered))
UNSEEN_GRASPS = Measure(
    "held of unseen kinds",
    "grasps held of kinds of objects that the grasp model was never trained on",
    _of_grasps(lambda p: p.held, unseen=True),
)
UNSEEN_DELIVERED = Measure(
    "delivered of unseen kinds",
    "put into the bin, of the same",
    _of_grasps(lambda p: p.delivered, unseen=True),
)
MEASURES = (
    *(SUCCESS, DROP_FREE, COST, DROPS, MEDIAN_PICKS, MEAN_PICKS, DECISION_S, PLANNING_S),
    *(GRASPS, DELIVERED, UNSEEN_GRASPS, UNSEEN_DELIVERED),
)


def ends(rows: Rows) -> Counter[str]:
    """How the completed trials ended."""
    return Counter(r.end for r in rows)


def attempts(rows: Rows) -> Counter[str]:
    """How the attempts of the completed trials ended."""
    return Counter(p.result for r in rows for p in r.picked)


def promises(rows: Rows) -> list[tuple[float, float, list[PickRow]]]:
    """The grasps that were carried out, by the probability they were given: low edge, high edge, picks of each bin."""
    tried = [(p.p, p) for r in rows for p in r.picked if p.grasp_tried and p.p is not None]
    return [
        (low, high, [pick for p, pick in tried if low <= p and (p < high or high == 1.0)])
        for low, high in pairwise(PROMISE_BINS)
    ]
