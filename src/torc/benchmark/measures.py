"""The measures and scores of planners' completed trials, each with its interval, and planners compared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

from torc.benchmark.intervals import (
    LEAST_P,
    NOTHING,
    Estimate,
    Sums,
    difference,
    mean,
    median,
    per_row,
    share,
    sign_flip_p,
)
from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.pipeline.state import EndReason

ORACLE, INFORMED = "oracle", "informed"
DROP_PRICES = (1, 5)
"""Prices of a dropped object in picks: as bad as one more pick, and much worse."""

Rows = Sequence[TrialRow]
Of = Callable[[Rows], Estimate]


@dataclass(frozen=True)
class Measure:
    """A column of the tables, of completed trials; `digits` after the point, None for two significant ones."""

    name: str
    of: Of
    digits: int | None = 2

    def text(self, rows: Rows) -> str:
        return self.of(rows).text(self.digits)


def _share(hit: Callable[[TrialRow], bool], counts: Callable[[TrialRow], bool] = lambda row: True) -> Of:
    return lambda rows: share(*per_row((r.problem, hit(r)) for r in rows if counts(r)))


def _mean(value: Callable[[TrialRow], float], counts: Callable[[TrialRow], bool] = lambda row: True) -> Of:
    """Return the measure of a mean that the budget of picks bounds."""

    def of(rows: Rows) -> Estimate:
        counted = [r for r in rows if counts(r)]
        budget = max((r.max_picks for r in counted), default=inf)
        return mean(*per_row((r.problem, value(r)) for r in counted), budget)

    return of


def _median_of_picks(
    value: Callable[[PickRow], float], counts: Callable[[PickRow], bool] = lambda pick: True
) -> Of:
    def of(rows: Rows) -> Estimate:
        picks = [(r.problem, value(p)) for r in rows for p in r.picked if counts(p)]
        return median([name for name, _ in picks], [number for _, number in picks])

    return of


def _grasps(good: Callable[[PickRow], bool], unseen: bool = False) -> Of:
    """Return the measure of a share of the executed grasps; `unseen`: only kinds outside the grasp model's training."""

    def of(rows: Rows) -> Estimate:
        picks = ((r.problem, p) for r in rows for p in r.picked)
        tried = ((name, p) for name, p in picks if p.grasp_tried and (p.unseen_kind or not unseen))
        return share(*per_row((name, good(p)) for name, p in tried))

    return of


SUCCESS = Measure("retrieved", _share(lambda r: r.solved))
DROP_FREE = Measure("with no drop", _share(lambda r: r.solved and r.drops == 0))
COST = Measure("picks to retrieval", _mean(lambda r: r.cost), 1)
DROPS = Measure("drops", lambda rows: mean(*per_row((r.problem, r.drops) for r in rows)))
MEDIAN_PICKS = Measure(
    "median picks", lambda rows: median([r.problem for r in rows], [r.picks for r in rows]), 0
)
DECISION_S = Measure("decision, s", _median_of_picks(lambda p: p.decision_s), None)
MEASURES = (
    *(SUCCESS, DROP_FREE, COST, DROPS, MEDIAN_PICKS),
    Measure("mean picks", _mean(lambda r: r.picks), 1),
    DECISION_S,
    Measure("pick planning, s", _median_of_picks(lambda p: p.planning_s, lambda p: p.motions_s > 0)),
    Measure("grasps held", _grasps(lambda p: p.held)),
    Measure("delivered", _grasps(lambda p: p.delivered)),
    Measure("held of unseen kinds", _grasps(lambda p: p.held, unseen=True)),
    Measure("delivered of unseen kinds", _grasps(lambda p: p.delivered, unseen=True)),
)
"""report/words.md says what each means."""
picks_where_solved = _mean(lambda r: r.picks, lambda r: r.solved)
"""Without accidents, but also without the hardest problems."""


def scores(table: Table, planner: str) -> dict[str, Estimate]:
    """Return by name what distinguishes planners when nearly every trial ends well: how soon, against the bounds, and
    what failed.
    """
    done = table.completed(planner)
    budget = max((r.max_picks for r in done), default=0)
    lost, wrong = EndReason.TARGET_LOST, EndReason.WRONG_OBJECT
    return {
        **{f"within {k}": within(done, k) for k in range(1, budget + 1)},
        "pick efficiency": efficiency(table, planner),
        **{f"more picks than {b}": regret(table, planner, b) for b in (ORACLE, INFORMED)},
        **{f"picks + {price} x drops": with_drops(done, price) for price in DROP_PRICES},
        "picks where retrieved": picks_where_solved(done),
        # It left the table, but not in the gripper: mostly an accident.
        "target lost": _share(lambda r: r.end == lost)(done),
        "failed otherwise": _share(lambda r: not r.solved and r.end not in (lost, wrong))(done),
        # Perception took it for the target.
        "wrong object": _share(lambda r: r.end == wrong)(done),
        "wrongly given up": _share(lambda r: r.end == EndReason.GAVE_UP, lambda r: not r.absent)(done),
        # Or the table was cleared.
        "rightly given up": _share(lambda r: r.solved, lambda r: r.absent)(done),
    }


def _pairs(table: Table, first: str, second: str) -> list[tuple[TrialRow, TrialRow]]:
    """Return the completed trials of two planners on the same problem and seed."""
    theirs = {(r.problem, r.seed): r for r in table.completed(second)}
    shared = ((r, theirs.get((r.problem, r.seed))) for r in table.completed(first))
    return [(ours, other) for ours, other in shared if other is not None]


def within(rows: Rows, picks: int) -> Estimate:
    """Return the share of trials that were solved in at most this many picks."""
    return share(*per_row((r.problem, r.solved and r.picks <= picks) for r in rows))


def efficiency(table: Table, planner: str) -> Estimate:
    """Return the mean of ORACLE's picks divided by the planner's on the same problem and seed, 0 where not solved.

    Above 1 where ORACLE was beaten. Only trials that ORACLE solved count. A trial that needs no pick, e.g. because the
    target is seen to be absent, counts as one that needs one. (P. Anderson et al., On evaluation of embodied navigation
    agents, 2018: success weighted by path length.)
    """
    ratios = [
        (own.problem, max(best.picks, 1) / max(own.picks, 1) if own.solved else 0.0)
        for own, best in _pairs(table, planner, ORACLE)
        if best.solved
    ]
    return mean(*per_row(ratios), max(1.0, *(ratio for _, ratio in ratios))) if ratios else NOTHING


def regret(table: Table, planner: str, reference: str) -> Estimate:
    """Return the mean of picks to retrieval minus those of a reference, on the same problem and seed."""
    pairs = _pairs(table, planner, reference)
    return difference(*per_row((own.problem, own.cost - best.cost) for own, best in pairs))


def with_drops(rows: Rows, price: float) -> Estimate:
    """Return the mean of picks to retrieval + price x drops."""
    return mean(*per_row((r.problem, r.cost + price * r.drops) for r in rows))


@dataclass(frozen=True)
class Comparison:
    """Two planners, by label, on the problems and seeds that both completed, `first` minus `second`.

    `p_cost` is the probability of a difference of cost as large as this one between equal planners.
    """

    first: str
    second: str
    pairs: int
    success: Estimate
    cost: Estimate
    drops: Estimate
    p_cost: float

    def p_text(self, p: float) -> str:
        """Return the p-value of cost, as corrected; "<" if no random signs made a difference as large."""
        return ("< " if self.p_cost <= LEAST_P * (1 + 1e-9) else "") + f"{p:.2g}"


def compare(table: Table, first: str, second: str) -> Comparison:
    """Compare two planners; all values are NaN if they share no trial."""
    pairs = _pairs(table, first, second)

    def gap(value: Callable[[TrialRow], float]) -> tuple[Sums, Sums]:
        return per_row((a.problem, float(value(a)) - float(value(b))) for a, b in pairs)

    cost, drops = gap(lambda r: r.cost), difference(*gap(lambda r: r.drops))
    success = difference(*gap(lambda r: r.solved), largest=1.0)
    return Comparison(first, second, len(pairs), success, difference(*cost), drops, sign_flip_p(cost[0]))
