"""What is measured of a planner's completed trials, each with its interval."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

from torc.benchmark.intervals import Estimate, by_problem, mean, median, share
from torc.benchmark.rows import PickRow, TrialRow

Rows = Sequence[TrialRow]


@dataclass(frozen=True)
class Measure:
    """A column of the tables: `of` makes a number of completed trials.

    `help` says it in a sentence; `digits` after the point, None for two significant ones.
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


def _of_picks(
    statistic: Callable[[list[str], list[float]], Estimate],
    value: Callable[[PickRow], float],
    counts: Callable[[PickRow], bool] = lambda pick: True,
) -> Callable[[Rows], Estimate]:
    """A statistic of all picks that count."""

    def of(rows: Rows) -> Estimate:
        picks = [(r.problem, p) for r in rows for p in r.picked if counts(p)]
        return statistic([name for name, _ in picks], [value(p) for _, p in picks])

    return of


def _share_of_picks(problems: list[str], good: list[float]) -> Estimate:
    return share(*by_problem(problems, good, [1] * len(good)))


def _tried(pick: PickRow) -> bool:
    return pick.grasp_tried


def _unseen(pick: PickRow) -> bool:
    return pick.grasp_tried and bool(pick.unseen_kind)


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
    "decision, s", "median time of one decision", _of_picks(median, lambda p: p.decision_s), None
)
PLANNING_S = Measure(
    "pick planning, s",
    "median time of planning a pick: grasps and motions, without the decision",
    _of_picks(median, lambda p: p.planning_s, lambda p: p.motions_s > 0),
)
GRASPS = Measure(
    "grasps held",
    "after the lift, of the grasps that were carried out",
    _of_picks(_share_of_picks, lambda p: p.held, _tried),
)
DELIVERED = Measure(
    "delivered", "put into the bin, of the same", _of_picks(_share_of_picks, lambda p: p.delivered, _tried)
)
UNSEEN_GRASPS = Measure(
    "held of unseen kinds",
    "grasps held of kinds of objects that the grasp model was never trained on",
    _of_picks(_share_of_picks, lambda p: p.held, _unseen),
)
UNSEEN_DELIVERED = Measure(
    "delivered of unseen kinds",
    "put into the bin, of the same",
    _of_picks(_share_of_picks, lambda p: p.delivered, _unseen),
)
MEASURES = (
    *(SUCCESS, DROP_FREE, COST, DROPS, MEDIAN_PICKS, MEAN_PICKS, DECISION_S, PLANNING_S),
    *(GRASPS, DELIVERED, UNSEEN_GRASPS, UNSEEN_DELIVERED),
)
