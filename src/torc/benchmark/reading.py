"""From the trials below a directory to a table."""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from torc.benchmark.comparable import comparable
from torc.benchmark.participation import participated
from torc.benchmark.playing import trial_spec
from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.benchmark.spec import BenchPlanner
from torc.benchmark.store import PROBLEMS, TRIALS, WORK, Store
from torc.benchmark.table_files import holds_tables, read_rows
from torc.episode.conditions import Conditions
from torc.episode.recorded import check_directory
from torc.episode.trial import TrialSpec
from torc.errors import InputError
from torc.generation.difficulty import Difficulty, stated_difficulty
from torc.scenes.library import object_facts
from torc.scenes.problem import Problem, load_problem
from torc.vlm.config import VlmConfig

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
        for trial in store.spec().trials:
            directory = store.directory(trial)
            planned.add(directory)
            spec = trial_spec(trial, store.problem_path(trial.problem))
            found = _row(directory, spec, asdict(spec), trial.id, trial.problem.category, store.result(trial))
            conditions = Conditions.model_validate(asdict(trial.settings)).text
            rows.append(replace(found, digest=trial.problem.digest, conditions=conditions))
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
    facts = json.loads((directory / "spec.json").read_text(encoding="utf-8"))
    vlm = VlmConfig(**facts["vlm"]) if facts.get("vlm") else None
    known = {k: v for k, v in facts.items() if k in TrialSpec.__dataclass_fields__ and k != "vlm"}
    spec = TrialSpec(**known, vlm=vlm)
    result = json.loads((directory / "result.json").read_text(encoding="utf-8"))
    problem = _problem(spec.problem)
    row = _row(directory, spec, facts, "", problem.category if problem else "unknown", result)
    return replace(row, conditions=Conditions.model_validate(facts).text)


def _row(
    directory: Path,
    spec: TrialSpec,
    facts: Mapping[str, Any],
    trial_id: str,
    category: str,
    result: Mapping[str, Any] | None,
) -> TrialRow:
    """facts: what is written down of the trial, older ones with less than a spec has now."""
    label = BenchPlanner(spec.planner, spec.vlm).label + (f" {spec.expert}" if spec.expert else "")
    label += " (outside view)" if spec.outside_view else ""
    place = (trial_id, directory, _stem(spec.problem), category, label, spec.seed)
    participant = participated(label, facts, result or {})
    if result is None:
        return TrialRow(*place, "missing", max_picks=spec.max_picks, participant=participant)
    version = str(result.get("versions", {}).get("torc", ""))
    status = str(result["status"])
    if status != "completed":
        cause, error = str(result.get("cause", "raised")), str(result.get("error", ""))
        budget = spec.max_picks
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
        max_picks=spec.max_picks,
        picked=tuple(_picks(directory / "events.jsonl", _problem(spec.problem))),
        version=version,
        participant=participant,
        bound=str(result.get("bound", "")),
    )


def _picks(log: Path, problem: Problem | None) -> Iterator[PickRow]:
    """The attempts in a log, up to the first that is not complete."""
    parts: dict[int, dict[str, Any]] = {}
    try:
        lines = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    except (OSError, ValueError):
        return
    for line in lines:
        if "pick" in line:
            parts.setdefault(int(line["pick"]), {})[line["event"]] = line
    unseen = _unseen_kinds(problem)
    for pick in sorted(parts):
        events = parts[pick]
        done = events.get("executed")
        if done is None:
            return
        decided = events.get("decided", {})
        yield PickRow(
            pick,
            str(done["result"]),
            int(done["object_id"]),
            int(decided.get("attempts", 0)),
            float(decided.get("seconds", 0.0)),
            float(sum(events.get("looked", {}).get("seconds", {}).values())),
            float(events.get("planned", {}).get("seconds", 0.0)),
            float(done.get("duration_s", 0.0)),
            len(done.get("dropped", ())),
            bool(done.get("held_after_lift")),
            unseen[done["object_id"]] if 0 <= done["object_id"] < len(unseen) else None,
            str(done.get("detail", "")),
            events.get("planned", {}).get("score"),
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


def _stem(name_or_path: str) -> str:
    return Path(name_or_path).stem if name_or_path.endswith((".yaml", ".yml")) else name_or_path


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
