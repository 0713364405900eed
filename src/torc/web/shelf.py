"""The trials below a directory, each under a short key: no path ever comes from an address."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torc.episode.recorded import (
    LOG,
    RecordedTrial,
    check_directory,
    find_trials,
    read_result,
    read_spec,
    read_trial,
)
from torc.episode.viewer_links import PARTIAL, trial_key
from torc.errors import InputError


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

    def withholds(self, trial: RecordedTrial) -> bool:
        """Return False: a reader of recorded trials has nothing to play."""
        return False


def open_shelf(root: Path) -> Shelf:
    """Return the trials of a directory. Raises InputError if there are none."""
    shelf = Shelf(root)
    check_directory(root)
    if not shelf.directories():
        raise InputError(
            f"There is no recorded trial in '{root}': none of its directories holds {LOG}. `torc run` makes one."
        )
    return shelf
