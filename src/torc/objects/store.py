"""Where objects live: directories full of `torc-object/1` directories. Light to import.

`TORC_OBJECTS` names those of the user (several are separated as in PATH; the first is where imports go). Without it
there is one: `torc/objects` in the user's data directory (`XDG_DATA_HOME`, or `~/.local/share`).
"""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torc.objects.models import ObjectModel

SHIPPED_OBJECTS = Path(__file__).parent / "data" / "shipped"
"""The objects that come with torc: drawn by `tools/objects`, never written to by torc."""
ENVIRONMENT_VARIABLE = "TORC_OBJECTS"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.\-]{0,63}")


def store_directories() -> tuple[Path, ...]:
    """Directories that hold the user's objects, in the order in which they are searched; they need not exist."""
    given = [
        Path(p).expanduser() for p in os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep) if p.strip()
    ]
    if given:
        return tuple(given)
    data = os.environ.get("XDG_DATA_HOME", "")
    # The specification has relative paths ignored.
    home = Path(data) if os.path.isabs(data) else Path("~/.local/share").expanduser()
    return (home / "torc" / "objects",)


def stored_objects() -> dict[str, Path]:
    """Names of the user's objects, sorted, and their directories. They are not read: some may turn out damaged."""
    stores = reversed(store_directories())  # the first one counts
    found = {place.name: place for store in stores for place in store.glob("*") if _is_object(place)}
    return dict(sorted(found.items()))


def find_stored(name: str) -> Path | None:
    """The directory of an object of the user, or None. Any text may be asked for: it never leads out of the store."""
    if not _NAME.fullmatch(name):
        return None
    return next((store / name for store in store_directories() if _is_object(store / name)), None)


def load_stored(directory: Path) -> ObjectModel:
    """The object in a directory of a store; read once while its files are the same. Raises InputError."""
    files = [directory / name for name in ("object.yaml", "geometry.npz")]
    # A missing one is told of where it is read.
    stamps = tuple(
        (s.st_ino, s.st_mtime_ns, s.st_size) for s in (file.stat() for file in files if file.exists())
    )
    return _load(directory.absolute(), stamps)


@lru_cache(maxsize=128)
def _load(directory: Path, stamps: tuple[tuple[int, int, int], ...]) -> ObjectModel:
    from torc.objects.files import load_object_directory

    return load_object_directory(directory, trusted=directory.parent == SHIPPED_OBJECTS)


def _is_object(directory: Path) -> bool:
    return _NAME.fullmatch(directory.name) is not None and (directory / "object.yaml").is_file()
