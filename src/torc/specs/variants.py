"""Variants of conditions to be compared with each other: "occlusion.smooth_px=0,3"."""

import re
from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import product
from typing import Any

import yaml

from torc.errors import InputError, UnknownNameError
from torc.registry.settings import Settings
from torc.specs.conditions import Conditions


def variants(sweeps: Sequence[str]) -> list[dict[str, Any]]:
    """Return every combination of the values in texts like "occlusion.smooth_px=0,3"; one empty variant without texts.

    Raises:
        InputError: a text has another form.
    """
    parsed = dict(_parsed(sweep) for sweep in sweeps)
    return [dict(zip(parsed, values)) for values in product(*parsed.values())]


def varied(conditions: Conditions, variant: Settings) -> Conditions:
    """Return the conditions with the changes of a variant. Raises UnknownNameError for an unknown field."""
    names = [f.name for f in fields(Conditions) if f.name != "settings"]
    settings = {k: v for k, v in variant.items() if "." in k}
    changes = {k: v for k, v in variant.items() if "." not in k}
    for name in changes:
        if name not in names:
            raise UnknownNameError("condition to compare", name, names)
    return replace(conditions, **changes, settings={**conditions.settings, **settings})


def plain_value(text: str) -> Any:
    """Read a text as YAML: a number, true, null, a list in brackets; otherwise return it unchanged.

    Digits after a 0, as in serial numbers, stay text: YAML would read them as octal.
    """
    if re.fullmatch(r"0[0-9_]+", text):
        return text
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return text


def _parsed(text: str) -> tuple[str, list[Any]]:
    name, equals, values = text.partition("=")
    found = plain_value(f"[{values}]") if equals else None
    if not name or not isinstance(found, list) or len(found) < 1:
        raise InputError(f"--sweep {text} names no values to compare: write e.g. occlusion.smooth_px=0,3.")
    return name.replace("-", "_"), found
