"""The trials below a directory, each under a short key: no path ever comes from an address."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torc.episode.recorded import LOG, RecordedTrial, check_directory, find_trials, read_trial
from torc.episode.trial_files import read_result, read_spec
from torc.episode.viewer_links import PARTIAL, trial_key
from torc.errors import InputError


@dataclass(frozen=True)
class Shelf:
    """Trials below `root`, or `root` itself if that is one."""

    root: Path
    _finished: dict[str, Path] = field(default_factory=dict, repr=False)
    """Directories that were found before: finished trials stay where they are."""

    def directories(self) -> dict[str, Path]:
        """Key -> directory, sorted by name; a finished trial goes before its own unfinished remains."""
        found: dict[str, Path] = {}
        for path in sorted(find_trials(self.root)):
            key = trial_key(path.relative_to(self.root).as_posix())
            if key not in found or found[key].name.endswith(PARTIAL):
                found[key] = path
        return found

    def read(self, key: str) -> RecordedTrial:
        """The trial of that key. Raises InputError: there is none, or it cannot be read."""
        directory = self._finished.get(key) or self._find(key)
        try:
            return read_trial(directory)
        except InputError:
            # A trial may just have been renamed: it is complete now, or it begins again.
            again = self._find(key)
            if again == directory:
                raise
            return read_trial(again)

    def _find(self, key: str) -> Path:
        directory = self.directories().get(key)
        if directory is None:
            raise InputError(
                "There is no such trial here. Reload the page; if a report's link led here, start `torc view` with the "
                "directory that was reported on."
            )
        if not directory.name.endswith(PARTIAL):
            self._finished[key] = directory
        return directory

    def lines(self) -> list[dict[str, Any]]:
        """A line per trial."""
        return [{"key": key, **_line(path, self.root)} for key, path in self.directories().items()]

    def withholds(self, trial: RecordedTrial) -> bool:
        """No: whoever looks here has nothing to play."""
        return False


def open_shelf(root: Path) -> Shelf:
    """The trials of a directory. Raises InputError where there are none."""
    shelf = Shelf(root)
    check_directory(root)
    if not shelf.directories():
        raise InputError(
            f"There is no recorded trial in '{root}': none of its directories holds {LOG}. `torc run` makes one."
        )
    return shelf


def _line(directory: Path, root: Path) -> dict[str, Any]:
    name = directory.relative_to(root).as_posix()
    line: dict[str, Any] = {"name": directory.resolve().name if name == "." else name}
    try:
        spec = read_spec(directory / "spec.json").spec
        line |= {
            "problem": spec.problem,
            "planner": spec.planner.name,
            "seed": spec.seed,
            "expert": spec.planner.expert,
        }
        result = directory / "result.json"
        status: dict[str, Any] = {"status": "unfinished"}
        if result.exists():
            status = read_result(result).summary
        return {**line, **status}
    except InputError as error:
        return {**line, "status": "unreadable", "error": str(error)}
