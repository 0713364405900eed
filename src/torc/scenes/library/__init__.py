"""The object library: household things of our own making, built on demand and deterministically, and whatever the
user has imported (`torc.scenes.object_store`).

`object_names()` is cheap; `load_object(name)` builds or reads a model once per process. A stored object never takes
the place of a built-in one.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from torc.errors import UnknownNameError
from torc.scenes.library.catalogue import ALL_KINDS
from torc.scenes.library.grasp_facts import graspable
from torc.scenes.library.kinds import Kind, Variant
from torc.scenes.object_store import find_stored, load_stored, stored_objects

if TYPE_CHECKING:  # the names alone need neither numpy nor Pillow
    from pathlib import Path

    from torc.scenes.models import ObjectModel

__all__ = [
    "Kind",
    "ObjectFacts",
    "Variant",
    "builtin_object_names",
    "graspable",
    "has_object",
    "held_out_kinds",
    "kind_names",
    "load_object",
    "object_description",
    "object_facts",
    "object_names",
]


@dataclass(frozen=True)
class ObjectFacts:
    """What is known of an object without building it.

    Attributes:
        name, kind, description, mass_kg, held_out: as in `ObjectModel`.
        builtin: comes with torc; otherwise the user has imported it.
    """

    name: str
    kind: str
    description: str
    mass_kg: float
    held_out: bool
    builtin: bool


@cache
def _variants() -> dict[str, tuple[Kind, Variant]]:
    return {variant.name: (kind, variant) for kind in ALL_KINDS for variant in kind.variants}


def object_names() -> tuple[str, ...]:
    """Names of all models: the built-in ones in catalogue order, then the user's own."""
    return (*_variants(), *(name for name in stored_objects() if name not in _variants()))


def builtin_object_names() -> tuple[str, ...]:
    """Names of the models that come with torc, in catalogue order: the same on every machine."""
    return tuple(_variants())


def has_object(name: str) -> bool:
    """Whether there is a model of that name, built-in or stored."""
    return name in _variants() or find_stored(name) is not None


def kind_names() -> tuple[str, ...]:
    """Names of all built-in kinds, in catalogue order."""
    return tuple(kind.name for kind in ALL_KINDS)


def held_out_kinds() -> tuple[str, ...]:
    """Kinds that no grasp model is trained on."""
    return tuple(kind.name for kind in ALL_KINDS if kind.held_out)


def object_facts(name: str) -> ObjectFacts:
    """Facts of a model, without building it. Raises UnknownNameError, or InputError if a stored one is damaged."""
    if name in _variants():
        kind, variant = _variants()[name]
        return ObjectFacts(name, kind.name, variant.description, variant.mass_kg, kind.held_out, True)
    from torc.scenes.object_files import read_entry

    entry = read_entry(_stored(name))
    return ObjectFacts(name, entry.kind, entry.description, entry.mass_kg, entry.held_out, False)


def object_description(name: str) -> str:
    """Short unique words for a model, without building it. Raises as `object_facts`."""
    return object_facts(name).description


def load_object(name: str) -> ObjectModel:
    """The model with that name. Raises UnknownNameError, or InputError if a stored one is damaged."""
    return _build(name) if name in _variants() else load_stored(_stored(name))


@cache
def _build(name: str) -> ObjectModel:
    from torc.scenes.library.parts import centered
    from torc.scenes.models import ObjectModel

    kind, variant = _variants()[name]
    module, function = kind.builder.split(":")
    build = getattr(importlib.import_module(f"torc.scenes.library.{module}"), function)
    pieces, visuals, size_m = centered(build(**variant.params))
    return ObjectModel(
        name=name,
        kind=kind.name,
        description=variant.description,
        mass_kg=variant.mass_kg,
        pieces=pieces,
        visuals=visuals,
        size_m=size_m,
        rolls=kind.rolls,
        friction=kind.friction,
        held_out=kind.held_out,
    )


def _stored(name: str) -> Path:
    directory = find_stored(name)
    if directory is None:
        raise UnknownNameError("object model", name, list(object_names()))
    return directory
