"""Put imported objects into the user's store, under unique names and descriptions."""

from collections import Counter, defaultdict
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from torc.errors import InputError
from torc.io.digests import file_fingerprint
from torc.objects.importing.mesh import FORMATS, MeshImport
from torc.objects.library import (
    builtin_object_names,
    find_stored,
    object_description,
    object_names,
    store_directories,
)
from torc.objects.object_files import check_replaceable, load_source, save_object

MAX_MESHES = 2_000
_RICHER = ("glb", "obj", "ply", "stl")
"""Order of preference among several files of one mesh: the format that can hold most first."""


def check_name(name: str, library: Path | None = None, overwrite: bool = False) -> Path:
    """Return the directory for an object of that name. Raises InputError if the name is taken."""
    if name in builtin_object_names():
        raise InputError(f"'{name}' is an object that comes with torc. Give another --name.")
    directory = (library or store_directories()[0]) / name
    check_replaceable(directory)
    taken = directory if directory.exists() else find_stored(name)
    if taken is not None and (not overwrite or taken.resolve() != directory.resolve()):
        raise InputError(
            f"There is an object '{name}' already, in {taken}. Give another --name, or --overwrite it."
        )
    return directory


def kept_names(files: Mapping[Path, str], scale: float, library: Path | None = None) -> dict[Path, str]:
    """Return which mesh files were imported before at that scale, and the names of their objects.

    `files` maps them to the names that they would get now; an object stands for one file.
    """
    made: dict[str, list[str]] = defaultdict(list)
    for file in sorted((library or store_directories()[0]).glob("*/object.yaml")):
        with suppress(InputError):  # a damaged one stands for no file
            source = load_source(file.parent)
            if source.scale == scale:
                made[source.sha256].append(file.parent.name)
    kept: dict[Path, str] = {}
    for path, name in files.items() if made else ():
        with suppress(OSError):  # importing it reports the fault
            if names := made.get(file_fingerprint(path)):
                kept[path] = names.pop(names.index(name) if name in names else 0)
    return kept


def check_library(library: Path | None = None) -> None:
    """Raise InputError if objects cannot be kept there."""
    directory = library or store_directories()[0]
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"Objects cannot be kept in {directory}: {error.strerror}. Give another --library."
        ) from error


def add_object(
    imported: MeshImport, library: Path | None = None, overwrite: bool = False, note: str = ""
) -> MeshImport:
    """Store an imported object in a library, by default the first directory of the store, with a note for people.

    Returns what was stored: its description gets a number if another object has that description. Raises InputError if
    the name is taken (and not `overwrite`), or the directory cannot be written.
    """
    directory = check_name(imported.model.name, library, overwrite)
    model = imported.model
    model = replace(model, description=unique_description(model.description, model.name))
    source = imported.source.model_copy(update={"note": note})
    save_object(model, directory, source, overwrite)
    return replace(imported, model=model, source=source)


def unique_description(wanted: str, name: str) -> str:
    """Return `wanted`, numbered if an object other than `name` is described so: planners distinguish objects by it."""
    taken = set()
    for other in object_names():
        with suppress(InputError):  # a damaged one does not matter
            if other != name:
                taken.add(object_description(other))
    number, found = 2, wanted
    while found in taken:
        found, number = f"{wanted} {number}", number + 1
    return found


def find_meshes(directory: Path) -> tuple[list[tuple[Path, str]], list[tuple[Path, str]]]:
    """Return mesh files in a directory and below, with a name for each; and those left out, with the reason.

    Of files that differ only in their ending, the richest format is taken, whatever they contain. Files of one name in
    different directories get these directories' names too. Raises InputError for far too many meshes.
    """
    by_stem: dict[Path, list[Path]] = defaultdict(list)
    for path in sorted(directory.rglob("*")):
        if path.suffix[1:].lower() in FORMATS and not path.is_dir():
            by_stem[path.with_suffix("")].append(path)
    if len(by_stem) > MAX_MESHES:
        raise InputError(f"{directory} holds more than {MAX_MESHES} meshes. Import parts of it.")
    alike = Counter(stem.name.lower() for stem in by_stem)
    named, left_out = [], []
    for stem, files in by_stem.items():
        best, *others = sorted(files, key=lambda p: _RICHER.index(p.suffix[1:].lower()))
        why = f"{best.name} is taken: of files of one name only one is, GLB before OBJ, PLY and STL"
        left_out += [(p, why) for p in others]
        alone = alike[stem.name.lower()] == 1
        named.append((best, best.stem if alone else "_".join(stem.relative_to(directory).parts)))
    return named, left_out
