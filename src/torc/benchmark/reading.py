"""Read the trials below directories into a table."""

import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from torc.benchmark.rows import REAL, TRIALS_FILE, PickRow, Table, TrialRow, participant_by_name, read_rows
from torc.benchmark.store import TRIALS, WORK, Store
from torc.errors import InputError
from torc.objects.library import object_facts
from torc.problems.problem import Problem, load_problem
from torc.specs.trial import TrialSpec
from torc.trials.log import TrialResult
from torc.trials.recorded import check_directory, picks_of, read_counted_events, read_result, read_spec
from torc.trials.versions import versions_text

_MAX_CURRENCY, _MAX_DEPTH = 8, 6


def read_tables(roots: Sequence[Path]) -> Table:
    """Return all trials of several directories in one table, as if they had been played into one.

    A directory contributes the trials that its benchmark planned, missing ones too, and any others below it. If it
    holds tables of an earlier report instead of a benchmark, these also count for trials that are gone. If a problem
    has changed between directories, only the trials of the first one's version count; of trials under several
    conditions, only those under the commonest ones.

    Raises:
        InputError: one of them holds no trial.
    """
    roots = roots if len(roots) == 1 else [root.resolve() for root in roots]
    found = [_read(root) for root in roots]
    everything = [row for rows, _ in found for row in rows]
    simulated, real = ([row for row in everything if row.real == which] for which in (False, True))
    rows, others = comparable(simulated or real)
    beside, more = comparable(real) if simulated and real else ((), ())
    root = roots[0] if len(roots) == 1 else Path(os.path.commonpath(roots))
    left_out = *(one for _, left_out in found for one in left_out), *others, *more
    return Table(root, rows, left_out, beside)


def read_table(root: Path) -> Table:
    """Return all trials below one directory. Raises InputError if there are none."""
    return read_tables([root])


def comparable(rows: Sequence[TrialRow]) -> tuple[tuple[TrialRow, ...], tuple[tuple[Path, str], ...]]:
    """Return the trials that can be compared, sorted by planner, problem and seed; and the other played ones, with
    reasons.

    Those under the commonest conditions count (the first of two equally common ones), of each problem the version of
    the first row, and one trial per planner, problem and seed.
    """
    played = [row for row in rows if row.played] or rows
    ((most, _),) = Counter(map(_conditions, played)).most_common(1)
    told = next(row.conditions for row in played if _conditions(row) == most) or "the defaults"
    problems: dict[str, TrialRow] = {}
    left_out: dict[Path, str] = {}
    alike = []
    for row in rows:
        here = _conditions(row) == most
        first = problems.setdefault(row.problem, row) if here and row.digest else row
        if here and first.digest == row.digest:
            alike.append(row)
        elif here and row.played:
            left_out[row.directory] = f"its {row.problem} is not the one of {first.directory}: it has changed"
        elif row.played:
            own = row.conditions or "the defaults"
            left_out[row.directory] = f"it was played with {own}, most others with {told}"
    cells: dict[tuple[str, str, int], TrialRow] = {}
    for row in sorted(alike, key=lambda row: row.played, reverse=True):
        first = cells.setdefault(row.cell, row)
        if first is not row and row.played:
            left_out[row.directory] = f"same planner, problem and seed as {first.directory}"
    return tuple(cells[key] for key in sorted(cells)), tuple(left_out.items())


def _conditions(row: TrialRow) -> str:
    """Return a trial's conditions; a robot counts by its digest, not by the name of its file."""
    return re.sub(r"robot .*? (\([0-9a-f]{8}\))", r"robot \1", row.conditions)


def _read(root: Path) -> tuple[list[TrialRow], list[tuple[Path, str]]]:
    """Return all rows below a directory, and the trials that do not count, with reasons."""
    check_directory(root, "torc bench")
    store, rows = Store(root), []
    left_out: list[tuple[Path, str]] = []
    planned: set[Path] = set()
    if store.is_there:
        plan = store.spec()
        conditions = plan.around.conditions.text(plan.around.sources)
        for trial in plan.trials:
            problem, directory = trial.problem, store.directory(trial)
            spec, result = trial.spec(store.problem_path(problem)), store.result(trial)
            facts = {"planner": trial.planner.label, "digest": problem.digest, "conditions": conditions}
            rows.append(_row(directory, spec, result, id=trial.id, category=problem.category, **facts))
            planned.add(directory)
    for directory in _trial_directories(root):
        if directory in planned:
            continue
        if directory.parent == root / TRIALS:
            left_out.append((directory, "another trial has taken its place"))
            continue
        try:
            rows.append(_loose(directory))
        except (InputError, ValueError, KeyError, TypeError) as error:
            left_out.append((directory, f"it cannot be read: {error}"))
    if not store.is_there and (root / TRIALS_FILE).is_file():
        found_here = {row.directory for row in rows}
        rows += (row for row in read_rows(root) if row.directory not in found_here)
    if not rows:
        raise InputError(f"There is no finished trial in '{root}'. `torc bench` and `torc run` make them.")
    return sorted(rows, key=lambda row: row.cell), left_out


def _loose(directory: Path) -> TrialRow:
    """Read a trial that no benchmark planned, from its spec.json and result.json."""
    recorded = read_spec(directory / "spec.json")
    result = read_result(directory / "result.json")
    problem = _problem(recorded.spec.problem)
    known = problem.category if problem else "unknown"
    category = REAL if (result.model_extra or {}).get("lab") else known
    return _row(directory, recorded.spec, result, category=category, conditions=recorded.conditions_text)


def _row(directory: Path, spec: TrialSpec, result: TrialResult | None, **more: Any) -> TrialRow:
    planner = spec.planner
    participant = result.participant if result is not None else None
    if participant is None:
        participant = participant_by_name(planner.label)
    facts: dict[str, Any] = {
        "id": "",
        "directory": directory,
        "problem": spec.problem_name,
        "planner": planner.label,
        "seed": spec.seed,
        "status": "missing",
        "max_picks": spec.conditions.max_picks,
        "participant": participant and not planner.outside_view,
    }
    if result is None:
        return TrialRow(**facts | more)
    facts |= {"status": result.status, "version": versions_text(result.versions)}
    if (use := result.vlm_use) is not None:
        facts |= {"vlm_calls": use.calls, "vlm_cost": use.cost, "currency": use.currency[:_MAX_CURRENCY]}
        facts |= {"tokens_sent": use.tokens_sent, "tokens_written": use.tokens_written}
    if result.completed:
        facts |= {name: getattr(result, name) for name in ("retrieved", "held_target", "picks", "drops")}
        facts |= {"end": result.end or "", "bound": result.bound, "absent": result.target_absent}
        facts["picked"] = tuple(_picks(directory / "events.jsonl", _problem(spec.problem)))
    else:
        facts |= {"cause": result.cause, "error": result.error or ""}
    return TrialRow(**facts | more)


def _picks(log: Path, problem: Problem | None) -> Iterator[PickRow]:
    """Yield the attempts in a log, up to the first incomplete one; none if it cannot be read."""
    try:
        picks = picks_of(read_counted_events(log))
    except InputError:
        return
    unseen = [object_facts(o.model).held_out for o in problem.ordered()] if problem is not None else []
    for number, pick in enumerate(picks):
        decided, planned, done = pick.decided, pick.planned, pick.executed
        if done is None:
            return
        yield PickRow(
            number,
            done.result,
            done.object_id,
            decided.attempts if decided else 0,
            decided.seconds if decided else 0.0,
            sum(pick.looked.seconds.values()),
            planned.seconds if planned else 0.0,
            done.duration_s,
            len(done.dropped),
            done.held_after_lift,
            unseen[done.meant_id] if 0 <= done.meant_id < len(unseen) else None,
            done.detail,
            planned.score if planned else None,
        )


@cache
def _problem(name_or_path: str) -> Problem | None:
    """Load a problem; None if it is gone: its trials still count."""
    try:
        return load_problem(name_or_path)
    except InputError:
        return None


def _trial_directories(root: Path) -> Iterator[Path]:
    """Yield directories with a result, except unfinished ones."""
    for path, below, files in os.walk(root):
        here = Path(path)
        if "result.json" in files and "spec.json" in files:
            below.clear()
            yield here
        elif len(here.relative_to(root).parts) >= _MAX_DEPTH:
            below.clear()
        below[:] = sorted(d for d in below if d != WORK and not d.endswith((".partial", ".replaced")))
