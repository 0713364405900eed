"""Text for terminals and programs."""

import json
import sys
from typing import Any


def printable(text: str) -> str:
    """The text with an escape for every control character but the end of a line.

    Names in strangers' files could otherwise move the cursor, change colors or clear the screen.
    """
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)


def split_names(text: str) -> tuple[str, ...]:
    """The names in an option such as "a, b"."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def print_json(data: Any) -> None:
    """Plain data on stdout."""
    print(json.dumps(data, indent=2))


def tell(text: str) -> None:
    """A line on stderr, beside tables and JSON on stdout."""
    print(printable(text), file=sys.stderr, flush=True)
