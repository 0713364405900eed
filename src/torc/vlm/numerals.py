"""An object's number as models write it in JSON: 6, 6.0, "6", "object 6", "object_6", "#6", or [6]."""

import re
from typing import Any

NAMES = r"(?:object|obj|id|number|no\.)"
"""Words that models put before a number."""
_NUMERAL = re.compile(rf"[\s\"'`]*(?:{NAMES}[\s_:]*)?#?([0-9]{{1,3}})[\s\"'`]*", re.IGNORECASE)


def number_in_text(text: str) -> int | None:
    """Return the number in a text that is a number, alone or after a word like "object"; None for any other text."""
    match = _NUMERAL.fullmatch(text)
    return int(match.group(1)) if match else None


def whole_number(value: Any) -> int | None:
    """Return the whole number in a JSON value: a number, a text, or a list of one of these. None for anything else.

    Negative numbers stay negative.
    """
    if isinstance(value, list) and len(value) == 1 and not isinstance(value[0], list):
        value = value[0]
    if isinstance(value, str):
        return number_in_text(value)
    whole = type(value) is int or (type(value) is float and value.is_integer())
    return int(value) if whole else None
