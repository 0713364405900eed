"""What every reader of a format is given."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from torc.errors import InputError
from torc.scenes.importing.reading.neighbours import Neighbours
from torc.scenes.importing.reading.pictures import PictureError, picture
from torc.scenes.importing.surfaces import Surface


@dataclass(frozen=True, eq=False)
class Reading:
    """One reading of one file.

    Attributes:
        path: names the file in errors.
        neighbours: the files that it may name; None: colours and textures are not asked for.
        texture_px: longest side of a texture.
        notes: what a user should know about the reading; readers add to it.
    """

    path: Path
    neighbours: Neighbours | None
    texture_px: int
    notes: list[str] = field(default_factory=list)
    _textures: dict[str, UInt8[np.ndarray, "h w 3"] | None] = field(default_factory=dict, init=False)

    def note(self, text: str) -> None:
        """Tells the user, once."""
        if text not in self.notes:
            self.notes.append(text)

    def texture_named(self, name: str) -> UInt8[np.ndarray, "h w 3"] | None:
        """The texture in a file that the mesh names; None if it is missing, or colours are not asked for.

        Raises InputError if it cannot be used.
        """
        if name not in self._textures:
            data = None if self.neighbours is None else self.neighbours.read(name)
            self._textures[name] = (
                None if data is None else self._texture(data, f"its texture '{name[:120]}'")
            )
        return self._textures[name]

    def texture_within(self, data: bytes) -> UInt8[np.ndarray, "h w 3"]:
        """A texture that the mesh carries. Raises InputError if it cannot be used."""
        return self._texture(data, "a texture")

    def _texture(self, data: bytes, what: str) -> UInt8[np.ndarray, "h w 3"]:
        try:
            return picture(data, self.texture_px)
        except PictureError as error:
            raise InputError(
                f"{self.path}: {what} cannot be used ({error}). Repair it, or leave textures out (--no-textures)."
            ) from None


SurfaceReader = Callable[[bytes, Reading], Iterator[Surface]]
"""Yields a file's surfaces in its own frame and units. Raises InputError."""
