"""The library of all objects: the shipped ones, and those that the user imported. Light to import.

The shipped ones are object files too, in `data/shipped`; they were drawn once, by `tools/objects`. Their index makes
`object_names()` and `object_facts()` cheap. A user's object never replaces a shipped one.

`TORC_OBJECTS` names the user's directories of objects (several are separated as in PATH; the first is where imports
go). Without it there is one: `torc/objects` in the user's data directory (`XDG_DATA_HOME`, or `~/.local/share`).
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from torc.errors import UnknownNameError
from torc.io.reading import read_text
from torc.objects.names import base_name, marked_description

if TYPE_CHECKING:  # the names alone need neither numpy nor Pillow
    from torc.objects.models import ObjectModel

SHIPPED_OBJECTS = Path(__file__).parent / "data" / "shipped"
"""The shipped objects: drawn by `tools/objects`, never written to by torc."""
ENVIRONMENT_VARIABLE = "TORC_OBJECTS"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.\-]{0,63}")
INDEX_FILE = "index.json"
FACTS_PATH = Path(__file__).parent / "data" / "graspable.json"
"""Which models the gripper can grasp with nothing else on the table, as measured in the simulator; the arm's reach is
checked in each scene. Made by `python -m tools.grasp_model graspable`.
"""


@dataclass(frozen=True)
class ObjectFacts:
    """What is known of an object without reading its shape: as in `ObjectModel`, and whether it is shipped."""

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
    """Return the names of all models: the shipped ones in the order of their index, then the user's own."""
    return (*_shipped(), *(name for name in stored_objects() if name not in _shipped()))


def builtin_object_names() -> tuple[str, ...]:
    """Return the names of the shipped models, in one order on every machine."""
    return tuple(_shipped())


def has_object(name: str) -> bool:
    """Check whether there is a model of that name: shipped, made from a shipped one, or stored by the user."""
    return name in _shipped() or base_name(name) in _shipped() or find_stored(name) is not None


def object_facts(name: str) -> ObjectFacts:
    """Return facts of a model. Raises UnknownNameError, or InputError if a stored one is damaged."""
    if name in _shipped():
        return _shipped()[name]
    if base := _shipped().get(base_name(name) or ""):
        return replace(base, name=name, description=marked_description(base.description))
    from torc.objects.object_files import read_entry

    entry = read_entry(_directory(name))
    return ObjectFacts(name, entry.kind, entry.description, entry.mass_kg, entry.held_out, False)


def object_description(name: str) -> str:
    """Return short unique words for a model. Raises as `object_facts`."""
    return object_facts(name).description


def load_object(name: str) -> ObjectModel:
    """Load the model with that name. Raises UnknownNameError, or InputError if a stored one is damaged."""
    if base := _shipped().get(base_name(name) or ""):
        from torc.objects.marked import marked

        return marked(load_stored(SHIPPED_OBJECTS / base.name))
    return load_stored(_directory(name))


def _directory(name: str) -> Path:
    directory = SHIPPED_OBJECTS / name if name in _shipped() else find_stored(name)
    if directory is None:
        raise UnknownNameError("object model", name, list(object_names()))
    return directory


def store_directories() -> tuple[Path, ...]:
    """Return the directories of the user's objects, in search order; they need not exist."""
    given = os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep)
    if directories := tuple(Path(p).expanduser() for p in given if p.strip()):
        return directories
    data = os.environ.get("XDG_DATA_HOME", "")
    # The specification says to ignore relative paths.
    home = Path(data) if os.path.isabs(data) else Path("~/.local/share").expanduser()
    return (home / "torc" / "objects",)


def stored_objects() -> dict[str, Path]:
    """Return the names of the user's objects, sorted, and their directories. They are not read: some may be damaged."""
    stores = reversed(store_directories())  # the first one wins
    found = {place.name: place for store in stores for place in store.glob("*") if _is_object(place)}
    return dict(sorted(found.items()))


def find_stored(name: str) -> Path | None:
    """Return the directory of a user's object, or None. Any text is safe: it never leads out of the store."""
    if not _NAME.fullmatch(name):
        return None
    return next((store / name for store in store_directories() if _is_object(store / name)), None)


def load_stored(directory: Path) -> ObjectModel:
    """Load the object in a directory of a store; read once while its files are unchanged. Raises InputError."""
    files = [directory / name for name in ("object.yaml", "geometry.npz")]
    stats = [file.stat() for file in files if file.exists()]  # a missing one is reported where it is read
    stamps = tuple((s.st_ino, s.st_mtime_ns, s.st_size) for s in stats)
    return _load(directory.absolute(), stamps)


@lru_cache(maxsize=128)
def _load(directory: Path, stamps: tuple[tuple[int, int, int], ...]) -> ObjectModel:
    from torc.objects.object_files import load_object_directory

    return load_object_directory(directory, trusted=directory.parent == SHIPPED_OBJECTS)


def _is_object(directory: Path) -> bool:
    return _NAME.fullmatch(directory.name) is not None and (directory / "object.yaml").is_file()


@dataclass(frozen=True)
class GraspFact:
    """The result of grasping a model that was alone on the table.

    Attributes:
        standing: share of turns in which some grasp held, in its natural pose.
        tumbled: that share after it was let go in a random orientation.
        digest: of the model's contact pieces and mass when this was measured.
    """

    standing: float
    tumbled: float
    digest: str


@cache
def read_facts(path: Path = FACTS_PATH) -> Mapping[str, GraspFact]:
    """Return the grasp facts in a file by model: by default those of the library."""
    content = json.loads(read_text(path))
    return {name: GraspFact(**fact) for name, fact in content["models"].items()}


def graspable(name: str) -> bool | None:
    """Return whether a model can be grasped as it stands, with nothing around it; None if never measured."""
    fact = read_facts().get(name)
    return None if fact is None else fact.standing > 0.0
