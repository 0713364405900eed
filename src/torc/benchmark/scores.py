"""Scores that separate planners where nearly every trial ends well: how soon, against the bounds, and what failed."""

from collections.abc import Iterator, Sequence

from torc.benchmark.intervals import NOTHING, Estimate, Sums, by_problem, difference, mean, share
from torc.benchmark.rows import Table, TrialRow
from torc.pipeline.state import EndReason

DROP_PRICES = (1, 5)
"""Picks that a dropped object is counted as: as bad as one more pick, and much worse."""
_OWN_COLUMN = (EndReason.TARGET_LOST, EndReason.WRONG_OBJECT)
ORACLE, INFORMED = "oracle", "informed"


def within(rows: Sequence[TrialRow], picks: int) -> Estimate:
    """Share of trials that were solved in at most so many picks."""
    return share(*_sums(rows, [r.solved and r.picks <= picks for r in rows]))


def efficiency(table: Table, planner: str) -> Estimate:
    """Mean of ORACLE's picks / one's own on the same problem and seed, 0 where not solved (P. Anderson et al., On
    evaluation of embodied navigation agents, 2018: success weighted by path length). Above 1 where ORACLE was beaten.

    Of the trials that ORACLE solved; a trial that needs no pick at all, as where the target is seen not to be there,
    counts as one that needs one.
    """
    pairs = [(own, best) for own, best in _pairs(table, planner, ORACLE) if best.solved]
    ratios = [max(best.picks, 1) / max(own.picks, 1) if own.solved else 0.0 for own, best in pairs]
    sums = _sums([own for own, _ in pairs], ratios)
    return mean(*sums, max(1.0, *ratios)) if ratios else NOTHING


def regret(table: Table, planner: str, reference: str) -> Estimate:
    """Mean of picks to retrieval less those of a reference, on the same problem and seed."""
    pairs = list(_pairs(table, planner, reference))
    gaps = [float(own.cost - best.cost) for own, best in pairs]
    return difference(*_sums([own for own, _ in pairs], gaps))


def with_drops(rows: Sequence[TrialRow], price: float) -> Estimate:
    """Mean of picks to retrieval + price x drops."""
    return mean(*_sums(rows, [r.cost + price * r.drops for r in rows]))


def lost(rows: Sequence[TrialRow]) -> Estimate:
    """Share of trials in which the target left the table otherwise than in the gripper: mostly an accident."""
    return share(*_sums(rows, [r.end == EndReason.TARGET_LOST for r in rows]))


def failed_otherwise(rows: Sequence[TrialRow]) -> Estimate:
    """Share of trials that ended without the target for any other reason."""
    return share(*_sums(rows, [not r.solved and r.end not in _OWN_COLUMN for r in rows]))


def false_give_ups(rows: Sequence[TrialRow]) -> Estimate:
    """Share of the trials whose target is there in which the planner gave up."""
    there = [r for r in rows if not r.absent]
    return share(*_sums(there, [r.end == EndReason.GAVE_UP for r in there]))


def right_give_ups(rows: Sequence[TrialRow]) -> Estimate:
    """Share of the trials whose target is not there in which the planner gave up, or cleared the table."""
    absent = [r for r in rows if r.absent]
    return share(*_sums(absent, [r.solved for r in absent]))


def wrong_objects(rows: Sequence[TrialRow]) -> Estimate:
    """Share of trials that ended with another object, which perception took for the target."""
    return share(*_sums(rows, [r.end == EndReason.WRONG_OBJECT for r in rows]))


def picks_where_solved(rows: Sequence[TrialRow]) -> Estimate:
    """Mean picks of the solved trials alone: no accident is in it, but neither are the hardest problems."""
    good = [r for r in rows if r.solved]
    most = max((r.max_picks for r in good), default=0)
    return mean(*_sums(good, [r.picks for r in good]), most)


def _sums(rows: Sequence[TrialRow], values: Sequence[float]) -> tuple[Sums, Sums]:
    sums, totals = by_problem([r.problem for r in rows], values, [1] * len(rows))
    return sums, totals


def _pairs(table: Table, planner: str, reference: str) -> Iterator[tuple[TrialRow, TrialRow]]:
    """The trials of a planner with those of a reference on the same problem and seed."""
    theirs = {(r.problem, r.seed): r for r in table.completed(reference)}
    for row in table.completed(planner):
        if (other := theirs.get((row.problem, row.seed))) is not None:
            yield row, other
