"""Scores that distinguish planners when nearly every trial ends well: how soon, against the bounds, and what failed."""

from collections.abc import Iterator, Sequence

from torc.benchmark.intervals import NOTHING, Estimate, Sums, by_problem, difference, mean, share
from torc.benchmark.rows import Table, TrialRow
from torc.pipeline.state import EndReason

DROP_PRICES = (1, 5)
"""Prices of a dropped object in picks: as bad as one more pick, and much worse."""
_OWN_COLUMN = (EndReason.TARGET_LOST, EndReason.WRONG_OBJECT)
ORACLE, INFORMED = "oracle", "informed"


def within(rows: Sequence[TrialRow], picks: int) -> Estimate:
    """Return the share of trials that were solved in at most this many picks."""
    return share(*_sums(rows, [r.solved and r.picks <= picks for r in rows]))


def efficiency(table: Table, planner: str) -> Estimate:
    """Return the mean of ORACLE's picks divided by the planner's on the same problem and seed, 0 where not solved.

    Above 1 where ORACLE was beaten. Only trials that ORACLE solved count. A trial that needs no pick, e.g. because the
    target is seen to be absent, counts as one that needs one. (P. Anderson et al., On evaluation of embodied navigation
    agents, 2018: success weighted by path length.)
    """
    pairs = [(own, best) for own, best in _pairs(table, planner, ORACLE) if best.solved]
    ratios = [max(best.picks, 1) / max(own.picks, 1) if own.solved else 0.0 for own, best in pairs]
    sums = _sums([own for own, _ in pairs], ratios)
    return mean(*sums, max(1.0, *ratios)) if ratios else NOTHING


def regret(table: Table, planner: str, reference: str) -> Estimate:
    """Return the mean of picks to retrieval minus those of a reference, on the same problem and seed."""
    pairs = list(_pairs(table, planner, reference))
    gaps = [float(own.cost - best.cost) for own, best in pairs]
    return difference(*_sums([own for own, _ in pairs], gaps))


def with_drops(rows: Sequence[TrialRow], price: float) -> Estimate:
    """Return the mean of picks to retrieval + price x drops."""
    return mean(*_sums(rows, [r.cost + price * r.drops for r in rows]))


def lost(rows: Sequence[TrialRow]) -> Estimate:
    """Return the share of trials in which the target left the table, but not in the gripper: mostly an accident."""
    return share(*_sums(rows, [r.end == EndReason.TARGET_LOST for r in rows]))


def failed_otherwise(rows: Sequence[TrialRow]) -> Estimate:
    """Return the share of trials that ended without the target for any other reason."""
    return share(*_sums(rows, [not r.solved and r.end not in _OWN_COLUMN for r in rows]))


def false_give_ups(rows: Sequence[TrialRow]) -> Estimate:
    """Return the share of the trials with a target in which the planner gave up."""
    there = [r for r in rows if not r.absent]
    return share(*_sums(there, [r.end == EndReason.GAVE_UP for r in there]))


def right_give_ups(rows: Sequence[TrialRow]) -> Estimate:
    """Return the share of the trials without a target in which the planner gave up, or cleared the table."""
    absent = [r for r in rows if r.absent]
    return share(*_sums(absent, [r.solved for r in absent]))


def wrong_objects(rows: Sequence[TrialRow]) -> Estimate:
    """Return the share of trials that ended with another object, which perception took for the target."""
    return share(*_sums(rows, [r.end == EndReason.WRONG_OBJECT for r in rows]))


def picks_where_solved(rows: Sequence[TrialRow]) -> Estimate:
    """Return the mean picks of the solved trials: without accidents, but also without the hardest problems."""
    good = [r for r in rows if r.solved]
    most = max((r.max_picks for r in good), default=0)
    return mean(*_sums(good, [r.picks for r in good]), most)


def _sums(rows: Sequence[TrialRow], values: Sequence[float]) -> tuple[Sums, Sums]:
    sums, totals = by_problem([r.problem for r in rows], values, [1] * len(rows))
    return sums, totals


def _pairs(table: Table, planner: str, reference: str) -> Iterator[tuple[TrialRow, TrialRow]]:
    """Yield the trials of a planner with those of a reference on the same problem and seed."""
    theirs = {(r.problem, r.seed): r for r in table.completed(reference)}
    for row in table.completed(planner):
        if (other := theirs.get((row.problem, row.seed))) is not None:
            yield row, other
