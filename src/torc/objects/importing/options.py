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
    MAX_PIECES,
    MAX_TEXTURE_PX,
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
        name: the object's name; by default the file's, without its ending.
        kind: its kind, for samples as different as possible; by default its name.
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
        max_faces: triangles to look at; meshes with more are simplified, their colours baked into a new texture.
        texture_px: longest side of a texture; larger ones are scaled down.
        max_pieces: upper limit of convex contact pieces.
        concavity: how deep a hollow may be that the contact pieces ignore, relative to the object's size (CoACD's
            threshold); smaller gives more pieces.
        limit_s: after this much computing, reading is given up; or the decomposition, and the convex hull is taken.
        memory_bytes: address space of the child process.
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
    max_faces: int = 20_000
    texture_px: int = 1024
    max_pieces: int = 24
    concavity: float = 0.05
    limit_s: float = 300.0
    memory_bytes: int = 6 * 2**30

    def __post_init__(self) -> None:
        for what, value, (low, high) in (
            ("scale", self.scale, (1e-6, 1e6)),
            ("mass", self.mass_kg, (MIN_MASS_KG, MAX_MASS_KG)),
            ("density", self.density_kg_m3, (1.0, 25_000.0)),
            ("friction", self.friction, (MIN_FRICTION, MAX_FRICTION)),
            ("max_faces", self.max_faces, (100, 100_000)),
            ("texture_px", self.texture_px, (16, MAX_TEXTURE_PX)),
            ("max_pieces", self.max_pieces, (1, MAX_PIECES)),
            ("concavity", self.concavity, (0.01, 1.0)),
        ):
            if value is not None and not low <= value <= high:
                raise InputError(f"The {what} must be between {low:g} and {high:g}, not {value}.")
        words = self.description
        if words is not None and not (
            0 < len(words.strip()) <= len(words) <= MAX_DESCRIPTION and words.isprintable()
        ):
            raise InputError(
                f"A description is a line of 1 to {MAX_DESCRIPTION} characters that can be printed, not "
                f"{words[:MAX_DESCRIPTION]!a}."
            )
        if self.up not in ("auto", "y", "z"):
            raise InputError(f"The axis that points up is auto, y or z, not '{self.up}'.")
        for what, name in (("name", self.name), ("kind", self.kind)):
            if name is not None and not re.fullmatch(NAME_PATTERN, name):
                raise InputError(
                    f"'{name}' cannot be a {what}: 1 to 64 letters, digits, '_', '-' or '.', starting with a letter "
                    "or digit."
                )

    def name_for(self, path: Path) -> str:
        """The object's name: the one given, or made from the file's, of which a long one keeps the end.

        Raises InputError if none can be made.
        """
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
