"""What a kind of thing is, as plain data, and the colours that its looks are made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

RED, BLUE, GREEN, YELLOW, ORANGE = "#c0281f", "#1f4fa8", "#2e8b3d", "#f2c230", "#e8771e"
WHITE, BLACK, BROWN, CREAM, PINK, PURPLE = "#fafafa", "#1a1a1a", "#6b3f1d", "#f6ead0", "#e77fa8", "#6a3d9a"
TEAL, GRAY, SKY = "#1b8a8f", "#8a8f96", "#8fc7ea"


@dataclass(frozen=True)
class Variant:
    """One model: its unique name, its unique short description, its mass and its builder's arguments."""

    name: str
    description: str
    mass_kg: float
    params: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Kind:
    """A kind of thing.

    Attributes:
        name: e.g. "soup_can".
        builder: "module:function" in this package; called with a variant's params.
        variants: its models.
        rolls: round: the simulator gives it rolling friction.
        held_out: never used to train a grasp model.
        friction: sliding friction coefficient.
    """

    name: str
    builder: str
    variants: tuple[Variant, ...]
    rolls: bool = False
    held_out: bool = False
    friction: float = 0.8


def look(
    base: str,
    text: str,
    accent: str,
    ink: str,
    motif: str = "none",
    color: str = WHITE,
    trim: str | None = None,
) -> dict[str, Any]:
    """Fields of a label's `Design`."""
    fields = {"base": base, "text": text, "accent": accent, "ink": ink, "motif": motif, "motif_color": color}
    return fields if trim is None else {**fields, "trim": trim}
