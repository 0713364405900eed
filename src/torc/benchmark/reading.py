"""From the trials below a directory to a table."""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from torc.benchmark.comparable import comparable
from torc.benchmark.participation import participated
from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.benchmark.store import PROBLEMS, TRIALS, WORK, Store
from torc.benchmark.table_files import holds_tables, read_rows
from torc.episode.recorded import check_directory, picks_of
from torc.episode.trial_files import read_events, read_spec
from torc.errors import InputError
from torc.generation.difficulty import Difficulty, stated_difficulty
from torc.objects.library import object_facts
from torc.problems.problem import Problem, load_problem
from torc.specs.trial import TrialSpec

_MAX_DEPTH = 6


def read_tables(roots: Sequence[Path]) -> Table:
    """All trials of several directories in one table, as if they had been played into one.

    Where a problem has changed between them, only the trials of the first directory's version count; where they were
    played under several conditions, only those of the commonest ones.

    Raises:
        InputError: there is no trial in one of them.
    """
    found = [_read(root if len(roots) == 1 else root.resolve()) for root in roots]
    rows, others = comparable([row for f in found for row in f.rows])
    left_out = (*(one for f in found for one in f.left_out), *others)
    counted = {row.directory for row in rows}
    difficulties: dict[str, Difficulty] = {}
    for f in reversed(found):
        difficulties |= _difficulties((row for row in f.rows if row.directory in counted), f.store)
    root = found[0].store.root if len(found) == 1 else Path(os.path.commonpath([f.store.root for f in found]))
    return Table(root, rows, left_out, difficulties)


def read_table(root: Path) -> Table:
    """All trials below a directory: those that its benchmark planned, missing ones too, and any others.

    Where it holds the tables of an earlier report instead of a benchmark, also what these say of trials that are gone.

    Raises:
        InputError: there is no trial.
    """
    return read_tables([root])


@dataclass(frozen=True)
class _Found:
    """What is below a directory, of whatever conditions and versions: `left_out` is what is no trial to count."""

    store: Store
    rows: Sequence[TrialRow]
    left_out: Sequence[tuple[Path, str]]


def _read(root: Path) -> _Found:
    check_directory(root, "torc bench")
    store, rows = Store(root), []
    left_out: list[tuple[Path, str]] = []
    planned: set[Path] = set()
    if store.is_there:
        plan = store.spec()
        base = plan.around
        for trial in plan.trials:
            directory = store.directory(trial)
            planned.add(directory)
            spec = trial.spec(store.problem_path(trial.problem))
            found = _row(directory, spec, trial.id, trial.problem.category, store.result(trial))
            label, text = trial.planner.label, base.conditions.text(base.sources)
            rows.append(replace(found, planner=label, digest=trial.problem.digest, conditions=text))
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
    if not store.is_there and holds_tables(root):
        found_here = {row.directory for row in rows}
        rows += (row for row in read_rows(root) if row.directory not in found_here)
    if not rows:
        raise InputError(f"There is no finished trial in '{root}'. `torc bench` and `torc run` make them.")
    return _Found(store, sorted(rows, key=lambda row: row.cell), left_out)


def _difficulties(rows: Iterable[TrialRow], store: Store) -> dict[str, Difficulty]:
    found = {}
    for name in sorted({r.problem for r in rows}):
        copy = store.root / PROBLEMS / f"{name}.yaml"
        problem = _problem(str(copy)) if copy.is_file() else _problem(name)
        stated = stated_difficulty(problem) if problem is not None else None
        if stated is not None:
            found[name] = stated
    return found


def _loose(directory: Path) -> TrialRow:
    """A trial that no benchmark planned, by its spec.json and result.json."""
    recorded = read_spec(directory / "spec.json")
    spec = recorded.spec
    result = json.loads((directory / "result.json").read_text(encoding="utf-8"))
    problem = _problem(spec.problem)
    row = _row(directory, spec, "", problem.category if problem else "unknown", result)
    return replace(row, conditions=recorded.conditions_text)


def _row(
    directory: Path,
    spec: TrialSpec,
    trial_id: str,
    category: str,
    result: Mapping[str, Any] | None,
) -> TrialRow:
    label, budget = spec.planner.label, spec.conditions.max_picks
    place = (trial_id, directory, spec.problem_name, category, label, spec.seed)
    participant = participated(spec.planner, result or {})
    if result is None:
        return TrialRow(*place, "missing", max_picks=budget, participant=participant)
    version = str(result.get("versions", {}).get("torc", ""))
    status = str(result["status"])
    if status != "completed":
        cause, error = str(result.get("cause", "raised")), str(result.get("error", ""))
        return TrialRow(
            *place, status, cause, error, max_picks=budget, version=version, participant=participant
        )
    return TrialRow(
        *place,
        status,
        retrieved=bool(result["retrieved"]),
        held_target=bool(result["held_target"]),
        end=str(result["end"]),
        picks=int(result["picks"]),
        drops=int(result["drops"]),
        max_picks=budget,
        picked=tuple(_picks(directory / "events.jsonl", _problem(spec.problem))),
        version=version,
        participant=participant,
        bound=str(result.get("bound", "")),
    )


def _picks(log: Path, problem: Problem | None) -> Iterator[PickRow]:
    """The attempts in a log, up to the first that is not complete; none where it cannot be read."""
    try:
        picks = picks_of(read_events(log))
    except InputError:
        return
    unseen = _unseen_kinds(problem)
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
            unseen[done.object_id] if 0 <= done.object_id < len(unseen) else None,
            done.detail,
            planned.score if planned else None,
        )


def _unseen_kinds(problem: Problem | None) -> list[bool]:
    """By object id."""
    return [object_facts(o.model).held_out for o in problem.ordered()] if problem is not None else []


@cache
def _problem(name_or_path: str) -> Problem | None:
    """None where it is not there any more: its trials still count."""
    try:
        return load_problem(name_or_path)
    except InputError:
        return None


def _trial_directories(root: Path) -> Iterator[Path]:
    """Directories with a result, but for unfinished ones and what is being played."""
    for path, below, files in os.walk(root):
        here = Path(path)
        if "result.json" in files and "spec.json" in files:
            below.clear()
            yield here
        elif len(here.relative_to(root).parts) >= _MAX_DEPTH:
            below.clear()
        below[:] = sorted(d for d in below if d != WORK and not d.endswith((".partial", ".replaced")))
