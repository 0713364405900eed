"""Read the number that a model's text names. No text raises an error."""

import re
from collections.abc import Collection
from typing import Any

from torc.vlm.answers import NAMES, number_in_text, whole_number
from torc.vlm.replies import MAX_CHARACTERS, find_json

ACTIONS = ("remove", "pick")
KEYS = ("answer", "number", "object", "object_id", "choice", "input")
"""Keys under which a JSON object may hold the number; or it holds a "plan", whose first action counts."""
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
    """Return the number that a reply names, if it is one of `numbers`; None if it names none of them, or several.

    The first of these that the reply has decides, even if it holds no valid number:

    1. a last line with "Answer: 7", but not "7 or 3" (or \\boxed{7});
    2. JSON, fenced or not: {"answer": 7}, or a plan, [{"action": "remove", "input": 7}, ...], alone or under "plan",
       whose first action counts;
    3. the last "Answer: 7" anywhere;
    4. a text that is one number, or a short one that holds just one.

    Text before </think> does not count. A letter is never an answer.
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
    if len(said) > _SHORT:
        return None
    bare = number_in_text(said.strip(_WRAPPING))
    return _only_number(said) if bare is None else bare


def _marked(text: str) -> int | None:
    found = _BOXED.findall(text) or _MARKED.findall(text)
    return int(found[-1]) if found else None


def _is_answer(data: Any) -> bool:
    """Check whether JSON has the form of an answer; other brackets in a text are not one."""
    if isinstance(data, dict):
        return "plan" in data or any(key in data for key in KEYS)
    return isinstance(data, list) and any(isinstance(item, dict) for item in data)


def _in_json(data: Any) -> int | None:
    plan = data if isinstance(data, list) else data.get("plan")
    if isinstance(plan, list):
        first = plan[0] if plan else None
        if not isinstance(first, dict) or first.get("action") not in ACTIONS:
            return None
        return whole_number(first.get("input"))
    return next((whole_number(data[key]) for key in KEYS if key in data), None)


def _only_number(said: str) -> int | None:
    """Return the number of a text that has no other one, e.g. "I would remove object 7."."""
    found = set(_NUMBERS.findall(said))
    alone = found.pop() if len(found) == 1 else ""
    return int(alone) if re.fullmatch("[0-9]{1,3}", alone) else None
