"""The measures of a planner's completed trials, each with its interval."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

from torc.benchmark.intervals import Estimate, Sums, by_problem, mean, median, share
from torc.benchmark.rows import PickRow, TrialRow

Rows = Sequence[TrialRow]


@dataclass(frozen=True)
class Measure:
    """A column of the tables, of completed trials; `digits` after the point, None for two significant ones."""

    name: str
    help: str
    of: Callable[[Rows], Estimate]
    digits: int | None = 2


def _sums(rows: Rows, value: Callable[[TrialRow], float]) -> tuple[Sums, Sums]:
    sums, totals = by_problem([r.problem for r in rows], [value(r) for r in rows], [1] * len(rows))
    return sums, totals


def _share(predicate: Callable[[TrialRow], bool]) -> Callable[[Rows], Estimate]:
    return lambda rows: share(*_sums(rows, predicate))


def _mean(value: Callable[[TrialRow], float]) -> Callable[[Rows], Estimate]:
    """Return the measure of a mean that the budget of picks bounds."""
    return lambda rows: mean(*_sums(rows, value), max((r.max_picks for r in rows), default=inf))


def _median_of_picks(
    value: Callable[[PickRow], float], counts: Callable[[PickRow], bool] = lambda pick: True
) -> Callable[[Rows], Estimate]:
    def of(rows: Rows) -> Estimate:
        picks = [(r.problem, value(p)) for r in rows for p in r.picked if counts(p)]
        return median([name for name, _ in picks], [number for _, number in picks])

    return of


def _share_of_grasps(good: Callable[[PickRow], bool], unseen: bool = False) -> Callable[[Rows], Estimate]:
    """Return the measure of a share of the executed grasps; `unseen`: only kinds outside the grasp model's training."""

    def of(rows: Rows) -> Estimate:
        tried = [
            (r.problem, good(p))
            for r in rows
            for p in r.picked
            if p.grasp_tried and (p.unseen_kind or not unseen)
        ]
        return share(*by_problem([name for name, _ in tried], [held for _, held in tried], [1] * len(tried)))

    return of


SUCCESS = Measure(
    "retrieved",
    "the target was held after the lift and delivered; where it is not there, given up",
    _share(lambda r: r.solved),
)
DROP_FREE = Measure(
    "with no drop", "and nothing else left the table", _share(lambda r: r.solved and r.drops == 0)
)
COST = Measure(
    "picks to retrieval",
    "mean; a trial that never retrieved the target counts as the whole budget: the paper's primary objective",
    _mean(lambda r: r.cost),
    1,
)
DROPS = Measure(
    "drops",
    "mean number of other objects dropped in a trial: the secondary objective",
    lambda rows: mean(*_sums(rows, lambda r: r.drops)),
)
MEDIAN_PICKS = Measure(
    "median picks",
    "of all completed trials",
    lambda rows: median([r.problem for r in rows], [r.picks for r in rows]),
    0,
)
MEAN_PICKS = Measure("mean picks", "of all completed trials", _mean(lambda r: r.picks), 1)
DECISION_S = Measure(
    "decision, s", "median time of one decision", _median_of_picks(lambda p: p.decision_s), None
)
PLANNING_S = Measure(
    "pick planning, s",
    "median time of planning a pick: grasps and motions, without the decision",
    _median_of_picks(lambda p: p.planning_s, lambda p: p.motions_s > 0),
)
GRASPS = Measure(
    "grasps held",
    "after the lift, of the grasps that were carried out",
    _share_of_grasps(lambda p: p.held),
)
DELIVERED = Measure("delivered", "put into the bin, of the same", _share_of_grasps(lambda p: p.delivered))
UNSEEN_GRASPS = Measure(
    "held of unseen kinds",
    "grasps held of kinds of objects that the grasp model was never trained on",
    _share_of_grasps(lambda p: p.held, unseen=True),
)
UNSEEN_DELIVERED = Measure(
    "delivered of unseen kinds",
    "put into the bin, of the same",
    _share_of_grasps(lambda p: p.delivered, unseen=True),
)
MEASURES = (
    *(SUCCESS, DROP_FREE, COST, DROPS, MEDIAN_PICKS, MEAN_PICKS, DECISION_S, PLANNING_S),
    *(GRASPS, DELIVERED, UNSEEN_GRASPS, UNSEEN_DELIVERED),
)
