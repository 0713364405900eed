"""Numbers in records that people make in Python: NumPy's become plain ones, everything else is refused."""

import math
import types
import typing
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from torc.errors import InputError


def take_numbers(record: Any) -> None:
    """Make the numbers of a frozen dataclass plain, for its __post_init__.

    Fields of int take Python's and NumPy's whole numbers, fields of float any real number, fields of bool either bool.

    Raises:
        InputError: a field holds anything else, e.g. True in place of a number.
    """
    for name, (kind, optional) in _kinds(type(record)).items():
        value = getattr(record, name)
        if value is None and optional:
            continue
        plain = _plain(kind, value)
        if plain is None:
            raise InputError(
                f"{name} is {value!r}; it must be {_WORDS[kind]}{' or None' if optional else ''}."
            )
        object.__setattr__(record, name, plain)


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the mapping with plain values in place of NumPy's scalars."""
    return {k: _of_python(v) for k, v in values.items()}


_WORDS = {int: "a whole number", float: "a number", bool: "True or False"}


def _plain(kind: type, value: Any) -> Any:
    """Return the value as a plain one of that kind; None if it is of another kind."""
    plain = _of_python(value)
    if isinstance(plain, bool):
        return plain if kind is bool else None
    if kind is int:
        return plain if isinstance(plain, int) else None
    if kind is float and isinstance(plain, int | float):
        # Whole numbers stay whole: labels and cache keys show them like that.
        return None if math.isnan(plain) else plain
    return None


def _of_python(value: Any) -> Any:
    """Return a NumPy scalar as Python's own, anything else unchanged.

    It does not import NumPy, because `torc --help` reads these records too.
    """
    scalar = type(value).__module__ == "numpy" and getattr(value, "shape", None) == ()
    return value.item() if scalar else value


def _kinds(cls: Any) -> dict[str, tuple[type, bool]]:
    """Return, for each field that holds only numbers, their kind and whether None is allowed."""
    hints = typing.get_type_hints(cls)
    found: dict[str, tuple[type, bool]] = {}
    for field in fields(cls):
        hint, optional = hints[field.name], False
        if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
            kinds = set(typing.get_args(hint))
            optional = type(None) in kinds
            hint = next(iter(kinds - {type(None)})) if len(kinds - {type(None)}) == 1 else None
        if hint in _WORDS:
            found[field.name] = (hint, optional)
    return found
