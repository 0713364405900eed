"""JSON from strangers: plain finite values only, and nothing that grows while it is read."""

import json
import math
from pathlib import Path
from typing import Any

from torc.errors import InputError
from torc.files.reading import read_bytes

MAX_BYTES = 32_000_000
"""The largest annotation file of GraspClutter6D has well under 1 MB."""
_MAX_DIGITS = 18


def read_json(path: Path, what: str) -> dict[str, Any]:
    """The object that a JSON file holds; `what` names the file's role in errors.

    Raises:
        InputError: missing, too large, a link, not JSON, nested too deeply, repeated keys, numbers that are not finite
            or absurdly long, or not an object.
    """
    content = read_bytes(path, MAX_BYTES, what)
    try:
        data = json.loads(
            content.decode("utf-8"),
            object_pairs_hook=_distinct,
            parse_int=_short_int,
            parse_float=_finite,
            parse_constant=_no_constant,
        )
    except RecursionError:
        raise InputError(f"{path} is nested too deeply to be {what}.") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not UTF-8 text: {error.reason} at byte {error.start}.") from None
    except ValueError as error:  # JSONDecodeError too
        raise InputError(f"{path} is not {what}: {error}. Unpack it again from the data set.") from None
    if not isinstance(data, dict):
        raise InputError(
            f"{path} is not {what}: it must hold an object {{...}}, not a {type(data).__name__}."
        )
    return data


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"the key {twice[:40]!r} is given more than once")
    return data


def _short_int(text: str) -> int:
    if len(text) > _MAX_DIGITS:
        raise ValueError(f"a number has {len(text)} digits")
    return int(text)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text[:40]} is not finite")
    return value


def _no_constant(text: str) -> float:
    raise ValueError(f"it holds {text}, which is no number")
