"""The trials of a page: those below a directory, and those that experts play in sequence.

Each has a short key: no path ever comes from an address.
"""

import re
import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torc.errors import InputError
from torc.pipeline.building import sources
from torc.specs.conditions import Conditions
from torc.specs.spec_files import RecordedSpec
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.trials.recorded import (
    LOG,
    VIDEO,
    RecordedTrial,
    check_directory,
    find_trials,
    read_result,
    read_spec,
    read_trial,
)
from torc.trials.trial import Trial
from torc.trials.viewer_links import PARTIAL, trial_key
from torc.web.session import NAME, Phase, Session

_EXPERT = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,31}")
Play = Callable[[TrialSpec, Path], Trial]
"""Plays one trial into a directory, replacing it."""


@dataclass(frozen=True)
class Shelf:
    """Trials below `root`, or `root` itself if it is a trial; with `only` that name's, even before it begins."""

    root: Path
    only: str = ""
    _finished: dict[str, Path] = field(default_factory=dict, repr=False)
    """Directories found before: finished trials stay where they are."""

    def directories(self) -> dict[str, Path]:
        """Return directories by key, sorted by name; a finished trial precedes its own unfinished remains."""
        if self.only:
            places = (self.root / self.only, self.root / (self.only + PARTIAL))
            return {trial_key(self.only): p for p in places if (p / LOG).is_file()}
        found: dict[str, Path] = {}
        for path in sorted(find_trials(self.root)):
            key = trial_key(path.relative_to(self.root).as_posix())
            if key not in found or found[key].name.endswith(PARTIAL):
                found[key] = path
        return found

    def read(self, key: str) -> RecordedTrial:
        """Return the trial of that key. Raises InputError: there is none, or it cannot be read."""
        try:
            return read_trial(self._finished.get(key) or self._find(key))
        except InputError:
            # A trial may just have been renamed: it is complete now, or it begins again.
            return read_trial(self._find(key))

    def _find(self, key: str) -> Path:
        directory = self.directories().get(key)
        if directory is None:
            raise InputError(
                "There is no such trial here. Reload the page; if a report's link led here, start `torc view` with the "
                "directory that was reported on."
            )
        if not directory.name.endswith(PARTIAL) and not self.only:
            self._finished[key] = directory
        return directory

    def lines(self) -> list[dict[str, Any]]:
        """Return a line per trial."""
        return [{"key": key, **self._line(path)} for key, path in self.directories().items()]

    def _line(self, directory: Path) -> dict[str, Any]:
        name = directory.relative_to(self.root).as_posix()
        line: dict[str, Any] = {"name": directory.resolve().name if name == "." else name}
        try:
            spec, result = read_spec(directory / "spec.json").spec, directory / "result.json"
            who = {"planner": spec.planner.name, "expert": spec.planner.expert}
            ended = read_result(result).summary if result.exists() else {"status": "unfinished"}
            return {**line, "problem": spec.problem, **who, "seed": spec.seed, **ended}
        except InputError as error:
            return {**line, "status": "unreadable", "error": str(error)}


def open_shelf(root: Path) -> Shelf:
    """Return the trials of a directory. Raises InputError if there are none."""
    shelf = Shelf(root)
    check_directory(root)
    if not shelf.directories():
        raise InputError(
            f"There is no recorded trial in '{root}': none of its directories holds {LOG}. `torc run` makes one."
        )
    return shelf


@dataclass(frozen=True)
class QueuedTrial:
    """A trial of the queue and where it is recorded."""

    spec: TrialSpec
    directory: Path

    @property
    def key(self) -> str:
        return trial_key(self.directory.name)

    @property
    def ended(self) -> dict[str, Any]:
        """How it ended; else the status "interrupted" or "waiting". Only a "completed" trial is not played again."""
        result = self.directory / "result.json"
        if result.exists():
            return read_result(result).summary
        partial = self.directory.with_name(self.directory.name + PARTIAL)
        return {"status": "interrupted" if partial.exists() else "waiting"}

    @property
    def completed(self) -> bool:
        return self.ended["status"] == "completed"

    @property
    def problem(self) -> str:
        return Path(self.spec.problem).stem


@dataclass(frozen=True)
class HumanQueue:
    """The trials that a person plays, in order."""

    trials: tuple[QueuedTrial, ...]

    def waiting(self) -> tuple[str, ...]:
        return tuple(t.key for t in self.trials if not t.completed)

    def play(self, session: Session, play: Play) -> None:
        """Play the trials that the page starts, until none is left. Ctrl-C ends it: KeyboardInterrupt."""
        message = ""
        while waiting := self.waiting():
            key = session.ask_start(waiting, message)
            chosen = next(t for t in self.trials if t.key == key)
            if chosen.directory.exists():  # errored: whoever asks for this trial now wants the new one
                aside = chosen.directory.with_name(chosen.directory.name + ".errored")
                shutil.rmtree(aside, ignore_errors=True)
                chosen.directory.rename(aside)
            try:
                result = play(chosen.spec, chosen.directory).result
            except InputError as error:
                # This problem cannot be played; the others can.
                message = str(error)
                continue
            if result.status == "interrupted":
                raise KeyboardInterrupt
            message = result.error or ""
        session.publish(phase=Phase.DONE, waiting=(), message=message)

    def lines(self) -> list[dict[str, Any]]:
        """Return a line per trial. Videos and replays are offered once nobody has to play their problem any more."""
        to_play = self._to_play()
        return [
            {
                "key": t.key,
                "name": t.directory.name,
                "problem": t.problem,
                "planner": NAME,
                "expert": t.spec.planner.expert,
                "seed": t.spec.seed,
                **t.ended,
                "video": t.problem not in to_play and (t.directory / VIDEO).is_file(),
                "replay": t.problem not in to_play and t.completed,
            }
            for t in self.trials
        ]

    def withholds(self, trial: RecordedTrial) -> bool:
        """True if a trial has ended, and so gives everything away, while somebody still has to play its problem."""
        return trial.result is not None and Path(trial.spec.problem).stem in self._to_play()

    def _to_play(self) -> set[str]:
        return {t.problem for t in self.trials if not t.completed}


def make_queue(
    problems: Iterable[str],
    experts: Iterable[str],
    out: Path,
    seed: int,
    conditions: Conditions,
    *,
    outside_view: bool = False,
) -> HumanQueue:
    """Queue every problem for every expert, expert by expert; without experts one unnamed person plays.

    Raises InputError: an expert's name cannot be a file name, two problems share theirs, or a complete trial was played
    under other conditions.
    """
    names = tuple(dict.fromkeys(experts)) or ("",)
    for name in names:
        if name and not _EXPERT.fullmatch(name):
            raise InputError(
                f"'{name}' cannot be an expert's name: at most 32 letters (a-z), digits, '.', '_' and '-'."
            )
    specs = [
        TrialSpec(problem, PlannerSpec(NAME, expert=expert, outside_view=outside_view), seed, conditions)
        for expert in names
        for problem in problems
    ]
    trials = tuple(QueuedTrial(spec, out / spec.default_name) for spec in specs)
    if len({t.key for t in trials}) < len(trials):
        raise InputError("Two problems have the same file name: their trials would be mixed up. Rename one.")
    for trial in trials:
        if trial.completed:
            there = _around(read_spec(trial.directory / "spec.json"))
            here = _around(RecordedSpec(trial.spec, sources(conditions)))
            if there != here:
                told = f"The trial in '{trial.directory}' was played with {there}; now it would be {here}"
                raise InputError(f"{told}. Choose another --out, or move it away.")
    return HumanQueue(trials)


def _around(recorded: RecordedSpec) -> str:
    budget = f"at most {recorded.spec.conditions.max_picks} picks"
    return ", ".join(filter(None, (budget, recorded.conditions_text)))
