"""Trials on disk as they can be read again: finished, interrupted, or being played at this moment."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torc.episode.log_lines import DecidedLine, ExecutedLine, LookedLine, PlannedLine, ResultFile, StartedLine
from torc.episode.pick_view import PickView, load_view
from torc.episode.trial_files import read_events, read_result, read_spec
from torc.errors import InputError
from torc.files.reading import read_bytes
from torc.specs.trial import TrialSpec

LOG, VIDEO = "events.jsonl", "video.mp4"
MAX_TRIALS, MAX_DEPTH = 20_000, 6
_MAX_PICTURE_BYTES = 32 * 2**20
_PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class RecordedPick:
    """What is known of one pick so far."""

    looked: LookedLine
    decided: DecidedLine | None = None
    planned: PlannedLine | None = None
    executed: ExecutedLine | None = None


@dataclass(frozen=True)
class RecordedTrial:
    """A trial as its directory tells it.

    Attributes:
        started: who tried what; None if it broke before.
        result: how it ended; None while it is played.
    """

    directory: Path
    spec: TrialSpec
    started: StartedLine | None
    picks: tuple[RecordedPick, ...]
    result: ResultFile | None

    def pick(self, number: int) -> RecordedPick:
        """Raises InputError where there is none."""
        if not 0 <= number < len(self.picks):
            raise InputError(f"This trial has no pick {number + 1}; it has {len(self.picks)}.")
        return self.picks[number]

    def picture(self, number: int) -> bytes:
        """The marked image of a pick, PNG. Raises InputError if it is missing or no PNG."""
        path = self._pick_path(number, "seen.png")
        picture = read_bytes(path, _MAX_PICTURE_BYTES, "the picture of a pick")
        if not picture.startswith(_PNG):
            raise InputError(f"{path} is no PNG picture.")
        return picture

    def view(self, number: int) -> PickView | None:
        """What the planner saw, in full; None where it was not recorded. Raises InputError if it is damaged."""
        path = self._pick_path(number, "view.npz")
        return load_view(path) if path.exists() else None

    @property
    def video(self) -> Path | None:
        """The video, if there is one."""
        path = self.directory / VIDEO
        return path if path.is_file() and not path.is_symlink() and self.result else None

    def _pick_path(self, number: int, name: str) -> Path:
        self.pick(number)
        return self.directory / "picks" / f"{number:02d}_{name}"


def read_trial(directory: Path) -> RecordedTrial:
    """What stands in a trial's directory. Raises InputError if that is no trial."""
    events = read_events(directory / LOG)
    result = directory / "result.json"
    return RecordedTrial(
        directory,
        read_spec(directory / "spec.json").spec,
        next((e for e in events if isinstance(e, StartedLine)), None),
        picks_of(events),
        read_result(result) if result.exists() else None,
    )


def picks_of(events: list[Any]) -> tuple[RecordedPick, ...]:
    """The picks in order, up to the first that was not looked at."""
    parts: dict[int, dict[str, Any]] = {}
    for event in events:
        if event.event not in ("started", "ended"):
            parts.setdefault(event.pick, {})[event.event] = event
    picks: list[RecordedPick] = []
    while "looked" in parts.get(len(picks), {}):
        picks.append(RecordedPick(**parts[len(picks)]))
    return tuple(picks)


def check_directory(root: Path, maker: str = "torc run") -> None:
    """Raises InputError where there is no such directory, and names the command that makes one."""
    if not os.path.isdir(root):  # unlike Path.is_dir, False for names that no directory can have
        raise InputError(f"'{root}' is not a directory. `{maker} --out DIR` makes one with trials in it.")


def find_trials(root: Path) -> list[Path]:
    """The directories of the trials below a directory, or itself if it is one; unfinished ones are among them. Raises
    InputError if there are more than MAX_TRIALS.
    """
    found: list[Path] = []
    for path, below, files in os.walk(root):
        here = Path(path)
        if LOG in files:
            found.append(here)
        if len(found) > MAX_TRIALS:
            raise InputError(
                f"There are more than {MAX_TRIALS:,} trials in '{root}': name a directory further down."
            )
        if LOG in files or len(here.relative_to(root).parts) >= MAX_DEPTH:
            below.clear()
    return found
