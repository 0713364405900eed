"""Known values of choices, in a file that travels with the project: finding them takes most of the time."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from torc import InputError
from torc.io.reading import read_text
from torc_next_object.making.pricing import Price

_DIGITS = 4


class KnownValues:
    """The lines of a file, by decision; without a file they are kept in memory. Raises InputError for another file.

    A line is {"id": "...", "values": {"OBJECT": [mean, low, high], ...}}, by the objects' ids in the problem.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._found: dict[str, dict[int, Price]] = {}
        lines = read_text(path).splitlines() if path is not None and path.exists() else []
        for number, line in enumerate(lines, start=1):
            try:
                entry = json.loads(line)
                self._found[entry["id"]] = _prices(entry["values"])
            except (ValueError, KeyError, TypeError, AttributeError):
                raise InputError(f"'{path}', line {number}: these are not values of choices.") from None

    def get(self, key: str) -> Mapping[int, Price] | None:
        """Return the values of a decision's choices; None if unknown."""
        return self._found.get(key)

    def add(self, key: str, values: Mapping[int, Price]) -> None:
        """Keep a decision's values, on the disk at once."""
        plain = {str(k): [round(v, _DIGITS) for v in (p.mean, p.low, p.high)] for k, p in values.items()}
        self._found[key] = _prices(plain)
        if self._path is not None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with open(self._path, "a", encoding="utf-8") as file:
                file.write(json.dumps({"id": key, "values": plain}) + "\n")


def _prices(values: Mapping[str, Any]) -> dict[int, Price]:
    return {int(k): Price(*map(float, three)) for k, three in values.items()}
