"""Finds the JSON in what a model wrote: fenced, after its thoughts, in the middle of a sentence, or not at all."""

import json
import re
from typing import Any

MAX_CHARACTERS = 50_000
"""Of a reply, only its last characters are read: an answer stands at the end."""
_MAX_TRIES = 500
_OPENING = re.compile(r"[\[{]")
_DECODER = json.JSONDecoder()


def find_json(text: str) -> Any:
    """The JSON object or array in a text that is most likely its answer, or None. Raises nothing.

    What stands in ``` fences comes before what does not; what holds an object, before bare lists such as "[1]"; of
    those, the last, for models repeat the question's form first.
    """
    text = text[-MAX_CHARACTERS:]
    fenced = [value for part in text.split("```")[1::2] for value in _values(part)]
    values = fenced or _values(text)
    return next((v for v in reversed(values) if _holds_object(v)), values[-1] if values else None)


def _values(text: str) -> list[Any]:
    """The outermost objects and arrays, in order; of very many brackets only the last are looked at."""
    found, end = [], 0
    for start in [opening.start() for opening in _OPENING.finditer(text)][-_MAX_TRIES:]:
        if start < end:
            continue
        try:
            value, end = _DECODER.raw_decode(text, start)
            found.append(value)
        except (ValueError, RecursionError):  # not JSON, or nested without end
            continue
    return found


def _holds_object(value: Any) -> bool:
    return isinstance(value, dict) or any(isinstance(item, dict) for item in value)
