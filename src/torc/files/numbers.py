"""Numbers of records that people make in Python: NumPy's become plain ones, and what is not a number is refused."""

import math
import types
import typing
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from torc.errors import InputError


def take_numbers(record: Any) -> None:
    """Make the numbers of a frozen dataclass plain, for its __post_init__.

    Fields of int take Python's and NumPy's whole numbers, fields of float any real number, fields of bool either bool.
    Raises InputError for everything else, True and False in place of numbers included.
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
    """A mapping with plain values in place of NumPy's scalars."""
    return {k: v.item() if isinstance(v, np.generic) else v for k, v in values.items()}


_WORDS = {int: "a whole number", float: "a number", bool: "True or False"}


def _plain(kind: type, value: Any) -> Any:
    """The value as a plain one of that kind; None if it is not of that kind."""
    if isinstance(value, bool | np.bool_):
        return bool(value) if kind is bool else None
    if kind is int:
        return int(value) if isinstance(value, int | np.integer) else None
    if kind is float and isinstance(value, int | float | np.integer | np.floating):
        # Whole numbers stay whole, since labels and cache keys show them so.
        plain = value.item() if isinstance(value, np.generic) else value
        return None if math.isnan(plain) else plain
    return None


def _kinds(cls: Any) -> dict[str, tuple[type, bool]]:
    """Kind of number and whether None is allowed, by field; of fields that hold numbers alone."""
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
