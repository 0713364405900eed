"""Read trials from disk: finished, interrupted, or being played.

Their files are checked, since they may come from a stranger.
"""

import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from torc.errors import InputError
from torc.io.reading import read_bytes, read_plain_text
from torc.specs.spec_files import RecordedSpec, from_plain
from torc.specs.trial import TrialSpec
from torc.trials.log import (
    COUNTED_LINE,
    EVENT_LINE,
    DecidedLine,
    EndedLine,
    EventLine,
    ExecutedLine,
    HaltedLine,
    LookedLine,
    PlannedLine,
    StartedLine,
    TrialResult,
)
from torc.trials.pick_view import PickView, load_view

LOG, VIDEO = "events.jsonl", "video.mp4"
SEEN, PLAIN = "seen.png", "plain.png"
"""Ends of the names of a pick's pictures: the marked one, and the camera's."""
BELIEF = "belief.png"
"""End of the name of the picture of a pick's belief, if its planner left one."""
MAX_TRIALS, MAX_DEPTH, MAX_SENT = 20_000, 6, 8
_MAX_PICTURE_BYTES = 32 * 2**20
_PNG = b"\x89PNG\r\n\x1a\n"
MAX_LOG_BYTES, MAX_FACTS_BYTES = 64 * 2**20, 2**20
_HALF_PAIR = re.compile(
    # Begins with plain text, which is found quickly.
    r"\\u[dD](?:[89abAB][0-9a-fA-F]{2}(?!\\u[dD][c-fC-F])|(?<!\\u[dD][89abAB]..\\u[dD])[c-fC-F][0-9a-fA-F]{2})"
)
_JSON = json.JSONDecoder(parse_constant=lambda _: None)


def sent_name(which: int) -> str:
    """Return the end of the file name of a picture that the chooser was sent; the first is 0."""
    return f"sent_{which + 1}.png"


@dataclass(frozen=True)
class RecordedPick:
    """What is known of one pick so far."""

    looked: LookedLine
    decided: DecidedLine | None = None
    planned: PlannedLine | None = None
    executed: ExecutedLine | None = None
    halted: HaltedLine | None = None


@dataclass(frozen=True)
class RecordedTrial:
    """A trial as its directory records it: `started` is None if it broke before, `result` while it is played."""

    directory: Path
    spec: TrialSpec
    started: StartedLine | None
    picks: tuple[RecordedPick, ...]
    result: TrialResult | None

    def pick(self, number: int) -> RecordedPick:
        """Return a pick. Raises InputError if it does not exist."""
        if not 0 <= number < len(self.picks):
            raise InputError(f"This trial has no pick {number + 1}; it has {len(self.picks)}.")
        return self.picks[number]

    def picture(self, number: int) -> bytes:
        """Return the marked image of a pick, PNG. Raises InputError if it is missing or not a PNG."""
        return self._picture(number, SEEN)

    def has_plain_picture(self, number: int) -> bool:
        """Check whether the camera's own picture of a pick was recorded; older versions kept only the marked one."""
        return self._pick_path(number, PLAIN).is_file()

    def plain_picture(self, number: int) -> bytes:
        """Return the camera's own picture of a pick, PNG. Raises InputError if it is missing or not a PNG."""
        return self._picture(number, PLAIN)

    def sent_picture(self, number: int, which: int) -> bytes:
        """Return a picture sent to the chooser, PNG; the first is 0. Raises InputError if missing or not a PNG."""
        return self._picture(number, sent_name(which))

    def sent_pictures(self, number: int) -> int:
        """Return how many pictures that the chooser was sent are there."""
        here = range(MAX_SENT)
        return next((k for k in here if not self._pick_path(number, sent_name(k)).is_file()), MAX_SENT)

    def belief(self, number: int) -> bytes:
        """Return the belief of a pick over the image, PNG, if the planner left one. Raises InputError as `picture`."""
        return self._picture(number, BELIEF)

    def view(self, number: int) -> PickView | None:
        """Return everything that the planner saw; None if it was not recorded. Raises InputError if it is damaged."""
        path = self._pick_path(number, "view.npz")
        return load_view(path) if path.exists() else None

    @property
    def video(self) -> Path | None:
        """The video, if there is one."""
        path = self.directory / VIDEO
        return path if path.is_file() and not path.is_symlink() and self.result else None

    def _picture(self, number: int, name: str) -> bytes:
        path = self._pick_path(number, name)
        picture = read_bytes(path, _MAX_PICTURE_BYTES, "the picture of a pick")
        if not picture.startswith(_PNG):
            raise InputError(f"{path} is no PNG picture.")
        return picture

    def _pick_path(self, number: int, name: str) -> Path:
        self.pick(number)
        return self.directory / "picks" / f"{number:02d}_{name}"


def read_trial(directory: Path) -> RecordedTrial:
    """Read a trial from its directory: finished, interrupted, or being played.

    Args:
        directory: as `torc run --out` wrote it.

    Returns:
        The trial; its result is None while it is played.

    Raises:
        InputError: the directory is not a trial, or a file in it is damaged.
    """
    events = read_events(directory / LOG)
    result = directory / "result.json"
    return RecordedTrial(
        directory,
        read_spec(directory / "spec.json").spec,
        next((e for e in events if isinstance(e, StartedLine)), None),
        picks_of(events),
        read_result(result) if result.exists() else None,
    )


def picks_of(events: Sequence[EventLine]) -> tuple[RecordedPick, ...]:
    """Return the picks in order, up to the first without a look."""
    parts: dict[int, dict[str, Any]] = {}
    for event in events:
        if not isinstance(event, StartedLine | EndedLine):
            parts.setdefault(event.pick, {})[event.event] = event
    picks: list[RecordedPick] = []
    while "looked" in parts.get(len(picks), {}):
        picks.append(RecordedPick(**parts[len(picks)]))
    return tuple(picks)


def check_directory(root: Path, maker: str = "torc run") -> None:
    """Raise InputError if the directory does not exist, naming the command that makes one."""
    if not os.path.isdir(root):  # unlike Path.is_dir, returns False for impossible names
        raise InputError(f"'{root}' is not a directory. `{maker} --out DIR` makes one with trials in it.")


def find_trials(root: Path) -> list[Path]:
    """Return the directories of all trials below a directory, or itself if it is one, including unfinished ones.

    Raises InputError if there are more than MAX_TRIALS.
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


def read_events(path: Path) -> list[EventLine]:
    """Return the complete lines of a log: a trial that is being played may be writing the last one.

    Raises InputError if it is missing, too large, or a line is not an event; names the line.
    """
    return _events(path, lambda line: EVENT_LINE.validate_python(_parsed(line)))


def read_counted_events(path: Path) -> list[EventLine]:
    """Read what tables count of a log, see `COUNTED_LINE`; the rest is not checked. Raises as `read_events`."""

    def counted(line: str) -> EventLine:
        try:
            return COUNTED_LINE.validate_json(line)
        except ValueError:  # perhaps NaN, or half a pair
            return COUNTED_LINE.validate_python(_parsed(line))

    return _events(path, counted)


def _events(path: Path, check: Callable[[str], EventLine]) -> list[EventLine]:
    text = read_plain_text(path, MAX_LOG_BYTES, "the log of a trial")
    whole, _, _ = text.rpartition("\n")
    events = []
    for number, line in enumerate(whole.split("\n") if whole else [], start=1):
        try:
            events.append(check(line))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}, line {number}: {_said(error)}. This is no log of a trial.") from None
    return events


def read_result(path: Path) -> TrialResult:
    """Read result.json. Raises InputError as `read_events`."""
    return _read(path, TrialResult.model_validate)


def read_spec(path: Path) -> RecordedSpec:
    """Read spec.json. Raises InputError as `read_events`."""
    return from_plain(_read(path), str(path))


def _read(path: Path, check: Callable[[Any], Any] = lambda plain: plain) -> Any:
    raw = read_plain_text(path, MAX_FACTS_BYTES, "facts of a trial")
    try:
        return check(_parsed(raw))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: {_said(error)}. It was not written by torc.") from None


def _parsed(text: str) -> Any:
    # Half a surrogate pair is not text; NaN and Infinity are not JSON, and no browser accepts them.
    return _JSON.decode(_HALF_PAIR.sub(r"\\ufffd", text))


def _said(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return f"{'.'.join(map(str, first['loc'])) or 'the whole'}: {first['msg']}"
    return "nested too deeply" if isinstance(error, RecursionError) else str(error)
