"""From an entry of the catalogue to a model."""

import importlib

from tools.objects.kinds import Kind, Variant
from tools.objects.parts import centered
from torc.objects.models import ObjectModel


def draw(kind: Kind, variant: Variant) -> ObjectModel:
    """The model of a variant."""
    module, function = kind.builder.split(":")
    build = getattr(importlib.import_module(f"tools.objects.{module}"), function)
    pieces, visuals, size_m = centered(build(**variant.params))
    return ObjectModel(
        name=variant.name,
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
