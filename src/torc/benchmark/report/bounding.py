"""What the report says of ORACLE as a bound: the gap to it, how sure that is, and where it is none."""

from collections.abc import Sequence
from typing import Any

from torc.benchmark.bounds import BEATEN, ORACLE, BoundedTrial, bounded_problems, bounded_trials, marks
from torc.benchmark.comparison import compare
from torc.benchmark.report.content import TextTable
from torc.benchmark.report.links import trial_cell
from torc.benchmark.report.wording import signed_text
from torc.benchmark.rows import Table, TrialRow


def bound_sentence(table: Table, planner: str | None) -> str:
    """The planner's gap to ORACLE and what it is worth; "" where ORACLE has completed no trial."""
    trials = bounded_trials(table)
    if not trials:
        return ""
    proved, problems = bounded_problems(trials)
    gap = "" if planner is None or planner == ORACLE else _gap(table, planner)
    told = ", ".join(f"{mark} in {count}" for mark, count in marks(trials).items())
    return (
        f"{gap}ORACLE's cost is a proved bound in every trial of {proved} of {problems} problems; "
        f"of its {len(trials)} trials it is {told}."
    )


def bounds_table(table: Table) -> TextTable:
    """Per problem, how sure it is that no planner could do with less."""
    rows = [
        (name, f"{_mean(found):.2g}", marks_text(found))
        for name, found in _by_problem(bounded_trials(table)).items()
    ]
    note = (
        "Trials by mark. Proved: no order of picks needs fewer picks, or as many with fewer drops; likely: every order "
        "that might, if a pick did nothing but take its object away, was tried; found: the best that was found within "
        "the budget, not proved; beaten: another planner did with less on the same problem and seed, so not proved; "
        "not recorded: played by an earlier torc."
    )
    return TextTable("ORACLE as a bound", ("problem", "ORACLE's picks", "bound"), tuple(rows), note)


def beaten_table(table: Table) -> TextTable:
    """The trials in which another planner did with less than ORACLE."""
    beaten = [t for t in bounded_trials(table) if t.better]
    rows = tuple(
        (
            t.row.problem,
            str(t.row.seed),
            _cost(t.row),
            _others(t.better),
            t.row.bound or "",
            trial_cell(table, t.row),
        )
        for t in beaten
    )
    header = ("problem", "seed", "ORACLE", "others", "ORACLE's own mark", "trial")
    note = "Picks to retrieval, drops in brackets where there are any. None of these problems is proved."
    return TextTable(f"Where ORACLE is beaten: {len(beaten)} trials", header, rows, note)


def marks_text(trials: Sequence[BoundedTrial]) -> str:
    """Marks with their numbers; the mark alone where all are alike."""
    found = marks(trials)
    return next(iter(found)) if len(found) == 1 else ", ".join(f"{mark} {n}" for mark, n in found.items())


def bound_summary(table: Table) -> dict[str, Any] | None:
    """Plain data; None where ORACLE has completed no trial."""
    trials = bounded_trials(table)
    if not trials:
        return None
    proved, problems = bounded_problems(trials)
    beaten = [{"problem": t.row.problem, "seed": t.row.seed} for t in trials if t.better]
    return {"problems": problems, "problems_proved": proved, "trials": marks(trials), BEATEN: beaten}


def _gap(table: Table, planner: str) -> str:
    found = compare(table, planner, ORACLE)
    if not found.pairs:
        return ""
    return f"Against ORACLE, which tries orders out in the simulation first: {signed_text(found.cost, 1)} picks. "


def _by_problem(trials: Sequence[BoundedTrial]) -> dict[str, list[BoundedTrial]]:
    found: dict[str, list[BoundedTrial]] = {}
    for t in sorted(trials, key=lambda t: t.row.problem):
        found.setdefault(t.row.problem, []).append(t)
    return found


def _mean(trials: Sequence[BoundedTrial]) -> float:
    return sum(t.row.cost for t in trials) / len(trials)


def _others(better: Sequence[TrialRow]) -> str:
    return ", ".join(f"{row.planner} {_cost(row)}" for row in better)


def _cost(row: TrialRow) -> str:
    return f"{row.cost} ({row.drops})" if row.drops else str(row.cost)
