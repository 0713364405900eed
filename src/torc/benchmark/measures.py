"""What is measured of a planner's completed trials, each with its interval."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

from torc.benchmark import intervals
from torc.benchmark.intervals import Estimate, by_problem
from torc.benchmark.rows import PickRow, TrialRow

Rows = Sequence[TrialRow]


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


def _share_of_trials(predicate: Callable[[TrialRow], bool]) -> Callable[[Rows], Estimate]:
    def of(rows: Rows) -> Estimate:
        return intervals.share(
            *by_problem([r.problem for r in rows], [predicate(r) for r in rows], [1] * len(rows))
        )

    return of


def _mean_of_trials(
    value: Callable[[TrialRow], float], most: Callable[[TrialRow], float] = lambda row: inf
) -> Callable[[Rows], Estimate]:
    """most: the value cannot be larger."""

    def of(rows: Rows) -> Estimate:
        sums, totals = by_problem([r.problem for r in rows], [value(r) for r in rows], [1] * len(rows))
        return intervals.mean(sums, totals, max((most(r) for r in rows), default=inf))

    return of


def _median_of_trials(value: Callable[[TrialRow], float]) -> Callable[[Rows], Estimate]:
    return lambda rows: intervals.median([r.problem for r in rows], [value(r) for r in rows])


def _median_of_picks(
    value: Callable[[PickRow], float], of_interest: Callable[[PickRow], bool]
) -> Callable[[Rows], Estimate]:
    def of(rows: Rows) -> Estimate:
        picks = [(r.problem, value(p)) for r in rows for p in r.picked if of_interest(p)]
        return intervals.median([name for name, _ in picks], [v for _, v in picks])

    return of


def _held(of_interest: Callable[[PickRow], bool]) -> Callable[[Rows], Estimate]:
    def of(rows: Rows) -> Estimate:
        tried = [(r.problem, p.held) for r in rows for p in r.picked if p.grasp_tried and of_interest(p)]
        return intervals.share(*by_problem([n for n, _ in tried], [h for _, h in tried], [1] * len(tried)))

    return of


SUCCESS = Measure(
    "retrieved",
    "the target was held after the lift and delivered",
    _share_of_trials(lambda r: r.retrieved),
)
DROP_FREE = Measure(
    "with no drop",
    "and nothing else left the table",
    _share_of_trials(lambda r: r.retrieved and r.drops == 0),
)
COST = Measure(
    "picks to retrieval",
    "mean; a trial that never retrieved the target counts as the whole budget: the paper's primary objective",
    _mean_of_trials(lambda r: r.cost, lambda r: r.max_picks),
    1,
)
DROPS = Measure(
    "drops",
    "mean number of other objects dropped in a trial: the secondary objective",
    _mean_of_trials(lambda r: r.drops),
)
MEDIAN_PICKS = Measure("median picks", "of all completed trials", _median_of_trials(lambda r: r.picks), 0)
MEAN_PICKS = Measure(
    "mean picks", "of all completed trials", _mean_of_trials(lambda r: r.picks, lambda r: r.max_picks), 1
)
DECISION_S = Measure(
    "decision, s",
    "median time of one decision",
    _median_of_picks(lambda p: p.decision_s, lambda p: True),
    None,
)
PLANNING_S = Measure(
    "pick planning, s",
    "median time of planning a pick: grasps and motions, without the decision",
    _median_of_picks(lambda p: p.planning_s, lambda p: p.motions_s > 0),
    2,
)
GRASPS = Measure("grasps held", "of the grasps that were carried out", _held(lambda p: True))
UNSEEN_GRASPS = Measure(
    "of unseen kinds",
    "the same for kinds of objects that the grasp model was never trained on",
    _held(lambda p: bool(p.unseen_kind)),
)

MEASURES = (
    SUCCESS,
    DROP_FREE,
    COST,
    DROPS,
    MEDIAN_PICKS,
    MEAN_PICKS,
    DECISION_S,
    PLANNING_S,
    GRASPS,
    UNSEEN_GRASPS,
)


def ends(rows: Rows) -> Counter[str]:
    """How the completed trials ended."""
    return Counter(r.end for r in rows)


def attempts(rows: Rows) -> Counter[str]:
    """How the attempts of the completed trials ended."""
    return Counter(p.result for r in rows for p in r.picked)
