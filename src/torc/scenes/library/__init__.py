"""The object library: household things of our own making, built on demand and deterministically.

`object_names()` is cheap; `load_object(name)` builds a model once per process.
"""

from __future__ import annotations

import importlib
from functools import cache
from typing import TYPE_CHECKING

from torc.errors import UnknownNameError
from torc.scenes.library.catalogue import Kind, Variant, all_kinds

if TYPE_CHECKING:  # the names alone need neither numpy nor Pillow
    from torc.scenes.models import ObjectModel

__all__ = [
    "Kind",
    "Variant",
    "held_out_kinds",
    "kind_names",
    "load_object",
    "object_description",
    "object_names",
]


@cache
def _variants() -> dict[str, tuple[Kind, Variant]]:
    return {variant.name: (kind, variant) for kind in all_kinds() for variant in kind.variants}


def object_names() -> tuple[str, ...]:
    """Names of all models, in catalogue order."""
    return tuple(_variants())


def kind_names() -> tuple[str, ...]:
    """Names of all kinds, in catalogue order."""
    return tuple(kind.name for kind in all_kinds())


def held_out_kinds() -> tuple[str, ...]:
    """Kinds that no grasp model is trained on."""
    return tuple(kind.name for kind in all_kinds() if kind.held_out)


def object_description(name: str) -> str:
    """Short unique words for a model, without building it. Raises UnknownNameError."""
    return _lookup(name)[1].description


@cache
def load_object(name: str) -> ObjectModel:
    """The model with that name, built on first use. Raises UnknownNameError."""
    from torc.scenes.library.parts import centered
    from torc.scenes.models import ObjectModel

    kind, variant = _lookup(name)
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


def _lookup(name: str) -> tuple[Kind, Variant]:
    try:
        return _variants()[name]
    except KeyError:
        raise UnknownNameError("object model", name, list(_variants())) from None
