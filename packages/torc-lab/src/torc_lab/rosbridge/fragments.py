"""Long messages of rosbridge, which some servers send in fragments."""

from collections.abc import Mapping
from typing import Any

from torc import TorcError

_MOST_BEGUN = 8
"""Messages of which some fragments came, and others not."""


class Fragments:
    """Fragments of messages until each is complete."""

    def __init__(self, most_characters: int) -> None:
        self._most = most_characters
        self._parts: dict[Any, dict[int, str]] = {}

    def joined(self, fragment: Mapping[str, Any]) -> str:
        """The message that a fragment completes, else "". Raises TorcError for one that is too long, or has a wrong
        number.
        """
        number, total = int(fragment["num"]), int(fragment["total"])
        if total * len(fragment["data"]) > self._most or not 0 <= number < total:
            raise TorcError("it sent fragments that are too long, or have wrong numbers")
        while len(self._parts) > _MOST_BEGUN:
            del self._parts[next(iter(self._parts))]
        parts = self._parts.setdefault(fragment["id"], {})
        parts[number] = fragment["data"]
        if len(parts) < total:
            return ""
        del self._parts[fragment["id"]]
        return "".join(parts[k] for k in range(total))
