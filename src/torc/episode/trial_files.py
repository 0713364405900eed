"""The small files of a trial, read and checked: they may come from a stranger."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from torc.episode.log_lines import LOG_LINE, ResultFile
from torc.errors import InputError
from torc.files.reading import read_bytes
from torc.specs.files import RecordedSpec, from_plain

MAX_LOG_BYTES, MAX_FACTS_BYTES = 64 * 2**20, 2**20
_HALF_PAIR = re.compile(
    r"\\u[dD][89abAB][0-9a-fA-F]{2}(?!\\u[dD][c-fC-F])|(?<!\\u[dD][89abAB]..)\\u[dD][c-fC-F][0-9a-fA-F]{2}"
)


def read_events(path: Path) -> list[Any]:
    """The lines of a log, as far as it is complete: a trial that is being played may be writing the last one. Raises
    InputError if it is missing, too large, or a line is no event; names the line.
    """
    text = read_bytes(path, MAX_LOG_BYTES, "the log of a trial").decode("utf-8", "replace")
    whole, _, _ = text.rpartition("\n")
    events = []
    for number, line in enumerate(whole.split("\n") if whole else [], start=1):
        try:
            events.append(LOG_LINE.validate_python(_parsed(line)))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}, line {number}: {_said(error)}. This is no log of a trial.") from None
    return events


def read_result(path: Path) -> ResultFile:
    """result.json. Raises InputError as `read_events`."""
    return _read(path, ResultFile.model_validate)


def read_spec(path: Path) -> RecordedSpec:
    """spec.json. Raises InputError as `read_events`."""
    return from_plain(_read(path), str(path))


def _read(path: Path, check: Callable[[Any], Any] = lambda plain: plain) -> Any:
    raw = read_bytes(path, MAX_FACTS_BYTES, "facts of a trial").decode("utf-8", "replace")
    try:
        return check(_parsed(raw))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: {_said(error)}. It was not written by torc.") from None


def _parsed(text: str) -> Any:
    # Half a surrogate pair is no text; NaN and Infinity are no JSON, and no browser takes them.
    return json.loads(_HALF_PAIR.sub(r"\\ufffd", text), parse_constant=lambda _: None)


def _said(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return f"{'.'.join(map(str, first['loc'])) or 'the whole'}: {first['msg']}"
    return "nested too deeply" if isinstance(error, RecursionError) else str(error)
