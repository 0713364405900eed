"""All objects: those that come with torc, and whatever the user has imported (`torc.objects.store`).

The shipped ones are object files too, in `data/shipped`; they were drawn once, by `tools/objects`. Their index makes
`object_names()` and `object_facts()` cheap. `load_object(name)` reads a model once per process. A user's object never
takes the place of a shipped one.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from torc.errors import UnknownNameError
from torc.objects.store import SHIPPED_OBJECTS, find_stored, load_stored, stored_objects

if TYPE_CHECKING:  # the names alone need neither numpy nor Pillow
    from pathlib import Path

    from torc.objects.models import ObjectModel

INDEX_FILE = "index.json"


@dataclass(frozen=True)
class ObjectFacts:
    """What is known of an object without reading its shape: as in `ObjectModel`, and whether it comes with torc."""

    name: str
    kind: str
    description: str
    mass_kg: float
    held_out: bool
    builtin: bool


@cache
def _shipped() -> dict[str, ObjectFacts]:
    text = (SHIPPED_OBJECTS / INDEX_FILE).read_text(encoding="utf-8")
    return {entry["name"]: ObjectFacts(**entry, builtin=True) for entry in json.loads(text)}


def object_names() -> tuple[str, ...]:
    """Names of all models: the shipped ones in the order of their index, then the user's own."""
    return (*_shipped(), *(name for name in stored_objects() if name not in _shipped()))


def builtin_object_names() -> tuple[str, ...]:
    """Names of the models that come with torc: the same, in the same order, on every machine."""
    return tuple(_shipped())


def has_object(name: str) -> bool:
    """Whether there is a model of that name, shipped or stored by the user."""
    return name in _shipped() or find_stored(name) is not None


def held_out_kinds() -> tuple[str, ...]:
    """Shipped kinds that no grasp model is trained on."""
    return tuple(dict.fromkeys(facts.kind for facts in _shipped().values() if facts.held_out))


def object_facts(name: str) -> ObjectFacts:
    """Facts of a model. Raises UnknownNameError, or InputError if a stored one is damaged."""
    if name in _shipped():
        return _shipped()[name]
    from torc.objects.files import read_entry

    entry = read_entry(_directory(name))
    return ObjectFacts(name, entry.kind, entry.description, entry.mass_kg, entry.held_out, False)


def object_description(name: str) -> str:
    """Short unique words for a model. Raises as `object_facts`."""
    return object_facts(name).description


def load_object(name: str) -> ObjectModel:
    """The model with that name. Raises UnknownNameError, or InputError if a stored one is damaged."""
    return load_stored(_directory(name))


def _directory(name: str) -> Path:
    directory = SHIPPED_OBJECTS / name if name in _shipped() else find_stored(name)
    if directory is None:
        raise UnknownNameError("object model", name, list(object_names()))
    return directory
