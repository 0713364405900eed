"""Whether ORACLE's costs are a bound: its trials' own marks, and what other planners show."""

from collections import Counter, defaultdict
from typing import Any

from torc.benchmark.comparison import compare
from torc.benchmark.report.cells import TextTable, signed_text, trial_cell
from torc.benchmark.rows import Table, TrialRow
from torc.episode.bound import Bound

ORACLE = "oracle"
BEATEN, UNRECORDED = "beaten", "not recorded"
MARKS = (Bound.PROVED.value, Bound.LIKELY.value, Bound.FOUND.value, UNRECORDED, BEATEN)
"""From the best down."""


def better_trials(table: Table) -> list[tuple[TrialRow, list[TrialRow]]]:
    """Return every completed trial of ORACLE with the trials of others that did with less on that problem and seed.

    Less is a lower cost, or equal cost and fewer drops; the best come first.
    """
    others: dict[tuple[str, int], list[TrialRow]] = defaultdict(list)
    for row in table.rows:
        if row.completed and row.planner != ORACLE:
            others[row.problem, row.seed].append(row)
    return [
        (row, sorted((o for o in others[row.problem, row.seed] if _cost(o) < _cost(row)), key=_cost))
        for row in table.completed(ORACLE)
    ]


def bound_summary(table: Table) -> dict[str, Any] | None:
    """Return plain data: problems, those with only proved trials, marks; None if ORACLE has completed no trial."""
    trials = better_trials(table)
    if not trials:
        return None
    # A beaten trial has proved nothing, whatever it says.
    found = [(row, BEATEN if better else row.bound or UNRECORDED) for row, better in trials]
    counts, problems = Counter(mark for _, mark in found), {row.problem for row, _ in found}
    doubtful = {row.problem for row, mark in found if mark != Bound.PROVED.value}
    return {
        "problems": len(problems),
        "problems_proved": len(problems - doubtful),
        "trials": {mark: counts[mark] for mark in MARKS if counts[mark]},
        BEATEN: [{"problem": row.problem, "seed": row.seed} for row, better in trials if better],
    }


def bound_sentence(table: Table, planner: str) -> str:
    """Return the planner's gap to ORACLE and what it is worth; "" if ORACLE has completed no trial."""
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


def beaten_table(table: Table) -> TextTable:
    """Return the trials in which another planner did with less than ORACLE."""
    rows = []
    for row, better in better_trials(table):
        if better:
            others = ", ".join(f"{other.planner} {_cost_text(other)}" for other in better)
            facts = row.problem, str(row.seed), _cost_text(row), others, row.bound or ""
            rows.append((*facts, trial_cell(table, row)))
    header = ("problem", "seed", "ORACLE", "others", "ORACLE's own mark", "trial")
    note = "Picks to retrieval, drops in brackets where there are any. None of these problems is proved."
    return TextTable(f"Where ORACLE is beaten: {len(rows)} trials", header, rows, note)


def _cost(row: TrialRow) -> tuple[int, int]:
    return row.cost, row.drops


def _cost_text(row: TrialRow) -> str:
    return f"{row.cost} ({row.drops})" if row.drops else str(row.cost)
