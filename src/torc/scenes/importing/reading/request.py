"""What every reader of a format is given."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from torc.scenes.importing.reading.pictures import Neighbours
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

    def note(self, text: str) -> None:
        """Tells the user, once."""
        if text not in self.notes:
            self.notes.append(text)


SurfaceReader = Callable[[bytes, Reading], Iterator[Surface]]
"""Yields a file's surfaces in its own frame and units. Raises InputError."""
