"""Whether ORACLE's costs are a bound: what its trials say of themselves, and what other planners show."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from torc.benchmark.comparison import compare
from torc.benchmark.report.cells import TextTable, signed_text, trial_cell
from torc.benchmark.rows import Table, TrialRow
from torc.episode.bound import Bound

ORACLE = "oracle"
BEATEN, UNRECORDED = "beaten", "not recorded"
MARKS = (Bound.PROVED.value, Bound.LIKELY.value, Bound.FOUND.value, UNRECORDED, BEATEN)
"""From the best down."""


@dataclass(frozen=True)
class BoundedTrial:
    """A trial of ORACLE beside those of the others.

    Attributes:
        better: trials of the same problem and seed with a lower cost, or the same cost and fewer drops; the best first.
    """

    row: TrialRow
    better: tuple[TrialRow, ...]

    @property
    def mark(self) -> str:
        """One of MARKS. Who is beaten has proved nothing, whatever its trial says."""
        return BEATEN if self.better else self.row.bound or UNRECORDED


def bounded_trials(table: Table) -> list[BoundedTrial]:
    """Every completed trial of ORACLE."""
    others: dict[tuple[str, int], list[TrialRow]] = {}
    for row in table.rows:
        if row.completed and row.planner != ORACLE:
            others.setdefault((row.problem, row.seed), []).append(row)

    def better(row: TrialRow) -> tuple[TrialRow, ...]:
        found = (o for o in others.get((row.problem, row.seed), ()) if _cost(o) < _cost(row))
        return tuple(sorted(found, key=_cost))

    return [BoundedTrial(row, better(row)) for row in table.completed(ORACLE)]


def marks(trials: Sequence[BoundedTrial]) -> dict[str, int]:
    """How many trials have each mark, the best first; only marks that occur."""
    counts = Counter(t.mark for t in trials)
    return {mark: counts[mark] for mark in MARKS if counts[mark]}


def bound_sentence(table: Table, planner: str) -> str:
    """The planner's gap to ORACLE and what it is worth; "" where ORACLE has completed no trial."""
    found = bound_summary(table)
    if found is None:
        return ""
    gap = ""
    if planner != ORACLE and (pair := compare(table, planner, ORACLE)).pairs:
        gap = f"Against ORACLE, which tries orders out in the simulation first: {signed_text(pair.cost, 1)} picks. "
    told = ", ".join(f"{mark} in {count}" for mark, count in found["trials"].items())
    return (
        f"{gap}ORACLE's cost is a proved bound in every trial of {found['problems_proved']} of {found['problems']} "
        f"problems; of its {sum(found['trials'].values())} trials it is {told}."
    )


def bound_summary(table: Table) -> dict[str, Any] | None:
    """Plain data: problems, those with nothing but proved trials, marks; None where ORACLE has completed no trial."""
    problems = _by_problem(table)
    trials = [t for found in problems.values() for t in found]
    if not trials:
        return None
    proved = sum(marks(found).keys() == {Bound.PROVED.value} for found in problems.values())
    beaten = [{"problem": t.row.problem, "seed": t.row.seed} for t in trials if t.better]
    return {"problems": len(problems), "problems_proved": proved, "trials": marks(trials), BEATEN: beaten}


def bounds_table(table: Table) -> TextTable:
    """Per problem, how sure it is that no planner could do with less."""
    rows = []
    for name, trials in _by_problem(table).items():
        found = marks(trials)
        told = ", ".join(f"{mark} {n}" for mark, n in found.items()) if len(found) > 1 else next(iter(found))
        rows.append((name, f"{np.mean([t.row.cost for t in trials]):.2g}", told))
    note = (
        "Trials by mark. Proved: no order of picks needs fewer picks, or as many with fewer drops; likely: every order "
        "that might, if a pick did nothing but take its object away, was tried; found: the best that was found within "
        "the budget, not proved; beaten: another planner did with less on the same problem and seed, so not proved; "
        "not recorded: played by an earlier torc."
    )
    return TextTable("ORACLE as a bound", ("problem", "ORACLE's picks", "bound"), rows, note)


def beaten_table(table: Table) -> TextTable:
    """The trials in which another planner did with less than ORACLE."""
    rows = []
    for t in bounded_trials(table):
        if t.better:
            others = ", ".join(f"{row.planner} {_cost_text(row)}" for row in t.better)
            facts = t.row.problem, str(t.row.seed), _cost_text(t.row), others, t.row.bound or ""
            rows.append((*facts, trial_cell(table, t.row)))
    header = ("problem", "seed", "ORACLE", "others", "ORACLE's own mark", "trial")
    note = "Picks to retrieval, drops in brackets where there are any. None of these problems is proved."
    return TextTable(f"Where ORACLE is beaten: {len(rows)} trials", header, rows, note)


def _by_problem(table: Table) -> dict[str, list[BoundedTrial]]:
    """In alphabetical order, as the rows of a table are."""
    return {name: list(found) for name, found in groupby(bounded_trials(table), lambda t: t.row.problem)}


def _cost(row: TrialRow) -> tuple[int, int]:
    return row.cost, row.drops


def _cost_text(row: TrialRow) -> str:
    return f"{row.cost} ({row.drops})" if row.drops else str(row.cost)
