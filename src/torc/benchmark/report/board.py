"""A square per trial, problems down, planners across, seeds side by side: how each went, and a link to look at it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from torc.benchmark.report.links import address_of
from torc.benchmark.report.wording import outcome
from torc.benchmark.rows import Table, TrialRow


class Went(StrEnum):
    """How a trial went."""

    CLEAN = "clean"
    """Retrieved, and nothing dropped."""
    DROPS = "drops"
    """Retrieved, with drops."""
    FAILED = "failed"
    ERRORED = "errored"
    MISSING = "missing"


MARKS = {Went.FAILED: "\N{MULTIPLICATION X}", Went.ERRORED: "!", Went.MISSING: "\N{MIDDLE DOT}"}
"""What stands in the squares of trials that did not retrieve the target."""


@dataclass(frozen=True)
class Square:
    """A trial.

    Attributes:
        went: how it went.
        text: the picks where the target was retrieved, else a mark.
        title: the same in words.
        address: where the viewer shows it; None where there is nothing to show.
    """

    went: Went
    text: str
    title: str
    address: str | None


@dataclass(frozen=True)
class Board:
    """All trials.

    Attributes:
        planners: the columns.
        rows: a problem, and the squares of each planner on it, seeds rising.
    """

    planners: tuple[str, ...]
    rows: tuple[tuple[str, tuple[tuple[Square, ...], ...]], ...]


def trial_board(table: Table, planners: Sequence[str]) -> Board:
    """The board of a table, planners in the given order."""
    cells: dict[tuple[str, str], list[Square]] = {}
    for row in table.rows:
        cells.setdefault((row.problem, row.planner), []).append(_square(table, row))
    rows = [(name, tuple(tuple(cells.get((name, p), ())) for p in planners)) for name in table.problems]
    return Board(tuple(planners), tuple(rows))


def _square(table: Table, row: TrialRow) -> Square:
    went = _went(row)
    told = f"{outcome(row)}, {row.picks} picks, {row.drops} dropped" if row.completed else row.status
    title = f"{row.planner} on {row.problem}, seed {row.seed}: {told}"
    return Square(went, MARKS.get(went, str(row.picks)), title, address_of(table, row))


def _went(row: TrialRow) -> Went:
    if not row.completed:
        return Went.MISSING if row.status == "missing" else Went.ERRORED
    if not row.retrieved:
        return Went.FAILED
    return Went.DROPS if row.drops else Went.CLEAN
