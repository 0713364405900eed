"""A benchmark on disk. A trial's directory exists whole or not at all, even if the runner was killed.

DIR/spec.json           the trials that belong to the benchmark (`torc-bench/2`)
DIR/manifest.json       one entry per call of `torc bench`: versions, commit, machine
DIR/problems/NAME.yaml  the problems as they were played
DIR/trials/NAME-ID/     a trial (`torc view` shows it); errored ones say why in result.json and error.txt
DIR/.work/              trials being played; a new runner empties it
"""

import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

import torc
from torc.benchmark.local_pool import Failure
from torc.benchmark.spec import Around, BenchPlanner, BenchProblem, BenchSpec, PlannedTrial, merged
from torc.errors import InputError
from torc.io.reading import read_text
from torc.io.results import try_lock, write_json
from torc.problems.problem import Problem, save_problem
from torc.specs.spec_files import to_plain
from torc.trials.log import RESULT_FORMAT, TrialResult
from torc.trials.recorded import LOG, read_result
from torc.trials.versions import versions

SPEC_FORMAT, _MANIFEST_FORMAT = "torc-bench/2", "torc-bench-manifest/1"
_MANIFEST, _GIT_PATIENCE_S = "manifest.json", 10


def to_json(spec: BenchSpec) -> dict[str, Any]:
    """Return plain data; `from_json` gives back an equal spec."""
    # Trials of one label may differ in source or version: each combination is written once.
    parts: dict[str, list[dict[str, Any]]] = {"problems": [], "planners": []}
    trials = [
        {
            "id": trial.id,
            "problem": _index(parts["problems"], asdict(trial.problem)),
            "planner": _index(parts["planners"], asdict(trial.planner)),
            "seed": trial.seed,
            "torc": trial.version,
            "directory": trial.directory_name,
        }
        for trial in spec.trials
    ]
    around = {"conditions": asdict(spec.around.conditions), "sources": dict(spec.around.sources)}
    return {"format": SPEC_FORMAT, **around, **parts, "trials": trials}


def from_json(data: Any) -> BenchSpec:
    """Read a spec from plain data. Raises what a wrong type, key or value raises."""
    if data["format"] != SPEC_FORMAT:
        raise ValueError(f"its format is {data['format']!r}; this torc reads {SPEC_FORMAT!r}")
    around = _AROUND.validate_python({k: data[k] for k in ("conditions", "sources")})
    problems = [BenchProblem(**p) for p in data["problems"]]
    planners = [_PLANNER.validate_python(p) for p in data["planners"]]

    def trial(entry: Mapping[str, Any]) -> PlannedTrial:
        problem, planner = problems[entry["problem"]], planners[entry["planner"]]
        facts = int(entry["seed"]), around.under(planner), str(entry["torc"]), str(entry["id"])
        return PlannedTrial(problem, planner, *facts)

    return BenchSpec(around, tuple(map(trial, data["trials"])))


_AROUND = TypeAdapter(Around)
_PLANNER = TypeAdapter(BenchPlanner)


def _index(entries: list[dict[str, Any]], entry: dict[str, Any]) -> int:
    entries += [] if entry in entries else [entry]
    return entries.index(entry)


SPEC, TRIALS, PROBLEMS = "spec.json", "trials", "problems"
WORK, LOCK = ".work", ".lock"
TRIAL, OUTPUT = "trial", "output.txt"
"""In a work directory: the trial, and what its process printed."""
MAX_SAID = 20_000
"""Characters of a broken trial's output that are kept."""


@dataclass(frozen=True)
class Store:
    """The directory of a benchmark."""

    root: Path

    @property
    def is_there(self) -> bool:
        """True if a benchmark was begun here. A single trial also has a file of that name, beside its log."""
        return (self.root / SPEC).is_file() and not (self.root / LOG).exists()

    def spec(self) -> BenchSpec:
        """Return the trials that belong to the benchmark. Raises InputError."""
        path = self.root / SPEC
        try:
            return from_json(json.loads(read_text(path)))
        except (OSError, ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise InputError(
                f"{path} is damaged, or a newer torc wrote it ({type(error).__name__}: {error}). Use another --out."
            ) from None

    def extended(self, spec: BenchSpec) -> BenchSpec:
        """Return the benchmark with these trials, not written yet. Raises InputError if they cannot be compared."""
        return merged(self.spec(), spec) if self.is_there else spec

    def extend(self, spec: BenchSpec, problems: Mapping[str, Problem]) -> BenchSpec:
        """Add trials to the benchmark, keep copies of the problems, and return the new benchmark.

        Raises InputError if they cannot be compared with the present ones.
        """
        whole = self.extended(spec)
        for name in (PROBLEMS, TRIALS):
            (self.root / name).mkdir(parents=True, exist_ok=True)
        for name, problem in problems.items():
            save_problem(problem, self.root / PROBLEMS / f"{name}.yaml")
        write_json(self.root / SPEC, to_json(whole))
        return whole

    def check(self) -> None:
        """Raise InputError if the directory is a trial."""
        if (self.root / LOG).exists():
            raise InputError(f"'{self.root}' is a trial, not a benchmark. Choose another --out.")

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the store for one runner, and discard what a killed one was playing. Raises InputError."""
        self.root.mkdir(parents=True, exist_ok=True)
        with open(self.root / LOCK, "w", encoding="utf-8") as lock:
            if try_lock(lock) is False:
                raise InputError(
                    f"Another `torc bench` is at work in '{self.root}'. Wait for it or use another --out."
                )
            shutil.rmtree(self.root / WORK, ignore_errors=True)
            try:
                yield
            finally:
                shutil.rmtree(self.root / WORK, ignore_errors=True)

    def directory(self, trial: PlannedTrial) -> Path:
        return self.root / TRIALS / trial.directory_name

    def problem_path(self, problem: BenchProblem) -> str:
        """Return what `load_problem` takes: shipped problems by name, others as they were when the benchmark began."""
        return problem.name if problem.shipped else str(self.root / PROBLEMS / f"{problem.name}.yaml")

    def result(self, trial: PlannedTrial) -> TrialResult | None:
        """Return the result of a trial; None if it has not been played, or cannot be read."""
        with suppress(InputError):
            return read_result(self.directory(trial) / "result.json")
        return None

    def left(self, spec: BenchSpec) -> list[PlannedTrial]:
        """Return the trials that are missing or errored."""
        return [t for t in spec.trials if (result := self.result(t)) is None or not result.completed]

    def work(self, trial: PlannedTrial) -> Path:
        """Return this runner's directory to play a trial in: leftovers of a killed runner cannot interfere."""
        return self.root / WORK / f"{os.getpid()}-{trial.id[:16]}"

    def accept(self, trial: PlannedTrial, work: Path, failure: Failure | None) -> TrialResult:
        """Move what was played from a work directory, which is removed, and return its result.

        `failure` says why the process gave no answer; None if it gave one.
        """
        output = work / OUTPUT
        said = output.read_bytes()[-MAX_SAID:] if output.is_file() else b""
        done = work / TRIAL if failure is None else self._as_errored(trial, work, failure, said)
        if said:
            (done / OUTPUT).write_bytes(said)
        place = self.directory(trial)
        if place.exists():  # errored before; without it, it is missing, and played again
            shutil.rmtree(place)
        os.replace(done, place)
        shutil.rmtree(work, ignore_errors=True)
        return read_result(place / "result.json")

    def _as_errored(self, trial: PlannedTrial, work: Path, failure: Failure, said: bytes) -> Path:
        """Turn what a process left behind, and what it printed, into an errored trial."""
        left = work / TRIAL if (work / TRIAL).is_dir() else work / f"{TRIAL}.partial"
        left.mkdir(parents=True, exist_ok=True)
        if not (left / "spec.json").is_file():
            spec = trial.spec(self.problem_path(trial.problem))
            write_json(left / "spec.json", to_plain(spec, trial.sources))
        log = f"{failure.kind}: {failure.text}\n\n{said.decode('utf-8', 'replace')}"
        (left / "error.txt").write_text(log, encoding="utf-8")
        cause, text = failure.kind.value, failure.text
        result = TrialResult(
            format=RESULT_FORMAT, status="errored", cause=cause, error=text, versions=versions()
        )
        write_json(left / "result.json", result.plain)
        return left


def begin_call(root: Path, **facts: Any) -> None:
    """Record that a call of `torc bench` begins: its versions, commit and machine."""
    call = {
        "started": _now(),
        "command": ["torc", *sys.argv[1:]],
        "commit": _commit(Path(torc.__file__).parent),
        "versions": versions(),
        "machine": _machine(),
    }
    write_calls(root, [*calls(root), call | facts])


def end_call(root: Path, **facts: Any) -> None:
    """Note when the latest call to a store ended, and further facts about it."""
    *before, last = calls(root)
    write_calls(root, [*before, last | {"ended": _now()} | facts])


def write_calls(root: Path, calls: Sequence[Mapping[str, Any]]) -> None:
    write_json(root / _MANIFEST, {"format": _MANIFEST_FORMAT, "calls": calls})


def calls(root: Path) -> list[dict[str, Any]]:
    """Return the recorded calls; none without a manifest. Raises InputError."""
    path = root / _MANIFEST
    try:
        return list(json.loads(read_text(path))["calls"]) if path.is_file() else []
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is damaged: {error}. Use another --out.") from None


def _commit(directory: Path) -> dict[str, Any] | None:
    """Return the commit of a directory's checkout, and whether files differ from it; None without a checkout."""

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(directory), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=_GIT_PATIENCE_S)
        return done.stdout.strip()

    try:
        changed = git("status", "--porcelain", "--untracked-files=no", "--", ".")
        return {"id": git("rev-parse", "HEAD"), "changed": bool(changed)}
    except (OSError, subprocess.SubprocessError):
        return None


def _machine() -> dict[str, Any]:
    processor = platform.machine()
    if (cpuinfo := Path("/proc/cpuinfo")).is_file():
        lines = cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines()
        processor = next((s.split(":", 1)[1].strip() for s in lines if s.startswith("model name")), processor)
    return {"processor": processor, "cores": os.cpu_count(), "system": platform.platform()}


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
