"""Numbers in records that people make in Python: NumPy's become plain ones, everything else is refused.

Does not import NumPy, because `torc --help` reads these records too.
"""

import types
import typing
from collections.abc import Mapping
from typing import Any

from torc.errors import InputError

_KINDS = {int: (int, "a whole number"), float: (int | float, "a number"), bool: (bool, "True or False")}
"""By the type of a field what it takes, and that in words. A whole number in a field of float stays whole: labels and
cache keys show it like that."""


def take_numbers(record: Any) -> None:
    """Make the numbers of a frozen dataclass plain, for its __post_init__.

    Fields of int take Python's and NumPy's whole numbers, fields of float any real number, fields of bool either bool.
    Raises InputError for anything else, e.g. True in place of a number.
    """
    for name, hint in typing.get_type_hints(type(record)).items():
        options = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
        kind, *others = [option for option in options if option is not types.NoneType]
        value = _plain(getattr(record, name))
        if kind not in _KINDS or others or (value is None and len(options) > 1):
            continue
        accepted, words = _KINDS[kind]
        is_bool, is_number = isinstance(value, bool), value == value  # NaN is not
        if not isinstance(value, accepted) or is_bool != (kind is bool) or not is_number:
            raise InputError(
                f"{name} is {value!r}; it must be {words}{' or None' if len(options) > 1 else ''}."
            )
        object.__setattr__(record, name, value)


def plain_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the mapping with plain values in place of NumPy's scalars."""
    return {k: _plain(v) for k, v in values.items()}


def _plain(value: Any) -> Any:
    """Return a NumPy scalar as Python's own, anything else unchanged."""
    scalar = type(value).__module__ == "numpy" and getattr(value, "shape", None) == ()
    return value.item() if scalar else value
