"""Text for terminals and programs."""

import json
import sys
from collections.abc import Callable
from typing import Any


def printable(text: str) -> str:
    """Return the text with an escape for every control character but line ends.

    Names in strangers' files could otherwise move the cursor, change colours or clear the screen.
    """
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)


def split_names(text: str) -> tuple[str, ...]:
    """Return the names in an option such as "a, b"."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def print_json(data: Any) -> None:
    """Print plain data to stdout."""
    print(json.dumps(data, indent=2))


def tell(text: str) -> None:
    """Print a line to stderr, beside tables and JSON on stdout."""
    print(printable(text), file=sys.stderr, flush=True)


def teller(as_json: bool) -> Callable[[str], None]:
    """Return a function that prints progress: to stdout, but to stderr beside JSON."""
    return tell if as_json else lambda text: print(printable(text), flush=True)
