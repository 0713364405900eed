"""Select the recorded trials and picks to export, and the split of each problem."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from torc.episode.recorded import RecordedPick, RecordedTrial, check_directory, find_trials, read_trial
from torc.errors import InputError
from torc.records import PickResult

SPLITS = ("train", "test")
EXPERTS = ("oracle", "human")
"""Planners whose choices are worth learning: the upper bound, and people."""
TAKEN_AWAY = (PickResult.REMOVED, PickResult.RETRIEVED)
"""Picks that brought an object out."""


@dataclass(frozen=True)
class Source:
    """A recorded trial to export; `key` is a short name, unique below one directory."""

    trial: RecordedTrial
    key: str

    @property
    def problem(self) -> str:
        """The problem's own name, not its file's."""
        started = self.trial.started
        return started.problem if started is not None else Path(self.trial.spec.problem).stem

    @property
    def planner(self) -> str:
        """Name of the task planner."""
        return self.trial.spec.planner.name

    @property
    def retrieved(self) -> bool:
        """True if the target was retrieved."""
        return self.trial.result is not None and self.trial.result.retrieved is True


def select_trials(root: Path, every: bool) -> Iterator[Source]:
    """Yield the completed trials below a directory, by rising path; unless `every`, only those that retrieved the
    target.

    Raises InputError: there is no recorded trial, or one cannot be read.
    """
    check_directory(root)
    directories = sorted(find_trials(root))
    if not directories:
        raise InputError(f"There is no recorded trial in '{root}'. `torc run --out DIR` makes one.")
    for directory in directories:
        trial = read_trial(directory)
        if trial.result is None or trial.result.status != "completed":
            continue
        name = directory.relative_to(root).as_posix()
        source = Source(trial, hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:8])
        if every or source.retrieved:
            yield source


def split_of(problem: str, test_share: float) -> str:
    """Return the split of a problem: by its name alone, so that adding trials and problems moves none."""
    place = int.from_bytes(hashlib.sha256(problem.encode()).digest()[:8]) / 2**64
    return "test" if place < test_share else "train"


def succeeded(pick: RecordedPick) -> bool:
    """True if the pick brought the chosen object out."""
    return pick.executed is not None and pick.executed.result in TAKEN_AWAY
