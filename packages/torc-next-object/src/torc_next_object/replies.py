"""From a model's text to the number that it names. Whatever the text holds, nothing is raised."""

import re
from collections.abc import Collection
from typing import Any

from torc.vlm.answers import NAMES, number_in_text, whole_number
from torc.vlm.replies import MAX_CHARACTERS, find_json

ACTIONS = ("remove", "pick")
KEYS = ("answer", "number", "object", "object_id", "choice", "input")
"""Names under which an object of JSON holds the number; or it holds a "plan", whose first action counts."""
_SHORT = 200
"""Characters; in a longer text a lone number may be anything."""
_THOUGHTS = re.compile(r"^.*</think(?:ing)?>", re.DOTALL | re.IGNORECASE)
_NAMED = rf"(?:{NAMES}[\s_]*)?#?"
_MARKED = re.compile(
    rf"\banswer\b(?:\s+is)?\s*[:=]?\s*(?:\\boxed\{{)?[\s\[({{\"'`*]{{0,6}}{_NAMED}"
    rf"([0-9]{{1,3}})(?![0-9]|[.,][0-9])(?![\s*`\"')\]]*(?:or|and|,|/|&|-)[\s*`\"'(\[]*{_NAMED}[0-9])",
    re.IGNORECASE,
)
_BOXED = re.compile(r"\\boxed\{\s*([0-9]{1,3})\s*\}")
_NUMBERS = re.compile(r"[-+]?[0-9]+(?:[.,][0-9]+)*(?:e[-+]?[0-9]+)?", re.IGNORECASE)
_WRAPPING = " \t\r\n.*_`\"'()[]{}<>#:;!"


def read_number(text: Any, numbers: Collection[int]) -> int | None:
    """The number that a reply names, if it is one of `numbers`; None for a reply that names none of them, or several.

    The first of these that the reply has decides, and if it says nothing of use, nothing else does:

    1. a last line with "Answer: 7", but not "7 or 3" (or \\boxed{7});
    2. JSON, fenced or not: {"answer": 7}, or a plan, [{"action": "remove", "input": 7}, ...], alone or under "plan",
       whose first action counts;
    3. "Answer: 7" somewhere, the last one;
    4. a text that is, or a short one that holds, one number and no other.

    What stands before </think> does not count. A letter is never an answer.
    """
    if not isinstance(text, str):
        return None
    said = _THOUGHTS.sub("", text[-MAX_CHARACTERS:])
    found = _named(said)
    return found if found is not None and found in numbers else None


def _named(said: str) -> int | None:
    last = next((line for line in reversed(said.splitlines()) if line.strip(" \t`*")), "")
    if (at_the_end := _marked(last)) is not None:
        return at_the_end
    data = find_json(said)
    if _is_answer(data):
        return _in_json(data)
    if (marked := _marked(said)) is not None:
        return marked
    bare = number_in_text(said.strip(_WRAPPING)) if len(said) <= _SHORT else None
    if bare is not None:
        return bare
    return _only_number(said) if len(said) <= _SHORT else None


def _marked(text: str) -> int | None:
    found = _BOXED.findall(text) or _MARKED.findall(text)
    return int(found[-1]) if found else None


def _is_answer(data: Any) -> bool:
    """Whether it has the form of an answer; what else stands in brackets in a text is none."""
    if isinstance(data, dict):
        return "plan" in data or any(key in data for key in KEYS)
    return isinstance(data, list) and any(isinstance(item, dict) for item in data)


def _in_json(data: Any) -> int | None:
    plan = data if isinstance(data, list) else data.get("plan")
    if isinstance(plan, list):
        first = plan[0] if plan else None
        if not isinstance(first, dict) or first.get("action") not in ACTIONS:
            return None
        return _natural(first.get("input"))
    return next((_natural(data[key]) for key in KEYS if key in data), None)


def _natural(value: Any) -> int | None:
    """A whole number that is not negative, from JSON."""
    number = whole_number(value)
    return number if number is not None and number >= 0 else None


def _only_number(said: str) -> int | None:
    """The number of a text that has no other one, e.g. "I would remove object 7."."""
    found = set(_NUMBERS.findall(said))
    alone = found.pop() if len(found) == 1 else ""
    return int(alone) if re.fullmatch("[0-9]{1,3}", alone) else None
