"""How a mesh becomes an object."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from torc.errors import InputError
from torc.objects.schema import (
    MAX_DESCRIPTION,
    MAX_FRICTION,
    MAX_MASS_KG,
    MIN_FRICTION,
    MIN_MASS_KG,
    NAME_PATTERN,
)

UpAxis = Literal["auto", "y", "z"]
FORMATS = ("obj", "glb", "stl", "ply")


@dataclass(frozen=True)
class MeshOptions:
    """How a mesh becomes an object. The defaults suit a solid, filled household thing in metres.

    Attributes:
        name: by default the file's, without its ending.
        kind: for samples as different as possible; by default its name.
        description: short words; by default "the " and the name.
        scale: metres per unit of the file, e.g. 0.001 for millimetres.
        up: axis of the file that points up; "auto" is y for GLB, as its standard has it, and z otherwise.
        stand: turn the object until it rests where it is set down; False keeps the file's axes.
        mass_kg: mass; by default volume of the contact pieces x density.
        density_kg_m3: of filled containers, fruit and tools on average (0.5 to 2.4 g/cm3 one by one).
        friction: sliding friction coefficient.
        rolls: adds rolling friction; None: if it is round about some axis.
        textures: read materials and textures ...
        root: ... from this directory and below; by default from the mesh's own.
    """

    name: str | None = None
    kind: str | None = None
    description: str | None = None
    scale: float = 1.0
    up: UpAxis = "auto"
    stand: bool = True
    mass_kg: float | None = None
    density_kg_m3: float = 850.0
    friction: float = 0.8
    rolls: bool | None = None
    textures: bool = True
    root: Path | None = None

    def __post_init__(self) -> None:
        for what, value, (low, high) in (
            ("scale", self.scale, (1e-6, 1e6)),
            ("mass", self.mass_kg, (MIN_MASS_KG, MAX_MASS_KG)),
            ("density", self.density_kg_m3, (1.0, 25_000.0)),
            ("friction", self.friction, (MIN_FRICTION, MAX_FRICTION)),
        ):
            if value is not None and not low <= value <= high:
                raise InputError(f"The {what} must be between {low:g} and {high:g}, not {value}.")
        words = self.description
        if words is not None and not (
            words.strip() and len(words) <= MAX_DESCRIPTION and words.isprintable()
        ):
            raise InputError(
                f"A description is a line of 1 to {MAX_DESCRIPTION} characters that can be printed."
            )
        for what, name in (("name", self.name), ("kind", self.kind)):
            if name is not None and not re.fullmatch(NAME_PATTERN, name):
                raise InputError(
                    f"'{name}' cannot be a {what}: 1 to 64 letters, digits, '_', '-' or '.', starting with a letter "
                    "or digit."
                )

    def name_for(self, path: Path) -> str:
        """The object's name: the one given, or made from the file's end. Raises InputError if none can be made."""
        if self.name is not None:
            return self.name
        name = re.sub(r"[^A-Za-z0-9_.\-]+", "_", path.stem).strip("_.-").lower()
        name = name[-64:].lstrip("_.-")  # files of a deep tree differ at the end
        if not name:
            raise InputError(f"No name can be made from '{path.name}'. Give one with --name.")
        return name

    def description_for(self, path: Path) -> str:
        """The description given, or the name in words."""
        if self.description is not None:
            return self.description
        return "the " + re.sub(r"[_.\-\s]+", " ", self.name_for(path)).strip()
