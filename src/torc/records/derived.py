"""Facts that follow from a record, computed once for all readers."""

import weakref
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Derived = TypeVar("Derived")
_KEPT: dict[int, dict[Hashable, Any]] = {}
"""By the record's `id`, until the record is deleted. Records hold arrays, so they cannot be keys themselves."""


def once(record: object, key: Hashable, derive: Callable[[], Derived]) -> Derived:
    """Return the result of `derive`, and keep it for the next call with this frozen record and key.

    The key names the derived fact and the settings that it depends on.
    """
    kept = _KEPT.get(id(record))
    if kept is None:
        kept = _KEPT[id(record)] = {}
        weakref.finalize(record, _KEPT.pop, id(record), None).atexit = False
    if key not in kept:
        kept[key] = derive()
    return kept[key]
