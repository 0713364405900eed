"""Imported objects into the user's store, under names and descriptions that nothing else has."""

import os
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from torc.errors import InputError
from torc.fingerprints import file_fingerprint
from torc.objects.files import check_replaceable, load_source, save_object
from torc.objects.importing.mesh import MeshImport
from torc.objects.importing.options import FORMATS
from torc.objects.library import builtin_object_names, object_description, object_names
from torc.objects.store import find_stored, store_directories

MAX_MESHES = 2_000
_RICHER = ("glb", "obj", "ply", "stl")
"""Which of several files of one mesh to take: the one that can hold most."""


def check_name(name: str, library: Path | None = None, overwrite: bool = False) -> Path:
    """The directory where an object of that name goes. Raises InputError if the name is taken."""
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
    """Which mesh files were imported before (this very file, by that scale), and what the objects are called.

    Files are known by their digests: what a file is called depends on the files beside it. An object stands for one
    file, first of all for that of its name: copies may have other textures.

    Args:
        files: mesh files, with the names that they would get now.
        scale: metres per unit of the files.
        library: where to look; by default in the first directory of the store.
    """
    left: dict[str, tuple[str, float]] = {}
    for file in sorted((library or store_directories()[0]).glob("*/object.yaml")):
        with suppress(InputError):  # a damaged one stands for no file
            source = load_source(file.parent)
            left[file.parent.name] = (source.sha256, source.scale)
    digests: dict[Path, str] = {}
    for path in files if left else ():
        with suppress(OSError):  # importing it says what is wrong
            digests[path] = file_fingerprint(path)
    kept = {path: files[path] for path in digests if left.get(files[path]) == (digests[path], scale)}
    for name in set(kept.values()):
        del left[name]
    for path, digest in digests.items():
        alike = next((name for name, made_of in left.items() if made_of == (digest, scale)), None)
        if path not in kept and alike is not None:
            kept[path] = alike
            del left[alike]
    return kept


def check_library(library: Path | None = None) -> None:
    """Makes sure that objects can be kept, and leaves nothing behind. Raises InputError if they cannot."""
    directory = library or store_directories()[0]
    try:
        nearest = next(place for place in (directory, *directory.absolute().parents) if place.exists())
        with tempfile.TemporaryDirectory(prefix=".import-", dir=nearest):
            pass
    except OSError as error:
        raise InputError(
            f"Objects cannot be kept in {directory}: {error.strerror}. Give another --library."
        ) from error


def add_object(
    imported: MeshImport, library: Path | None = None, overwrite: bool = False, note: str = ""
) -> MeshImport:
    """Stores an imported object, which can be used at once; returns what was stored.

    Args:
        imported: the object; its description gets a number if another object has the same.
        library: where; by default the first directory of the store.
        overwrite: replace an object of the same name there.
        note: kept with the object, e.g. its licence.

    Raises:
        InputError: the name is taken, or the directory cannot be written.
    """
    directory = check_name(imported.model.name, library, overwrite)
    model = replace(
        imported.model, description=unique_description(imported.model.description, imported.model.name)
    )
    source = imported.source.model_copy(update={"note": note})
    save_object(model, directory, source, overwrite)
    return replace(imported, model=model, source=source)


def unique_description(wanted: str, name: str) -> str:
    """`wanted`, with a number if an object other than `name` is described so: planners tell objects apart by it."""
    taken = set()
    for other in object_names():
        with suppress(InputError):  # a damaged one is in nobody's way
            if other != name:
                taken.add(object_description(other))
    number, found = 2, wanted
    while found in taken:
        found, number = f"{wanted} {number}", number + 1
    return found


def find_meshes(directory: Path) -> tuple[list[tuple[Path, str]], list[tuple[Path, str]]]:
    """Mesh files in a directory and below, with a name for each; and those left out, with the reason.

    Of files that differ in their ending only, the richest format is taken, whatever is in them. Files of the same name
    in different directories get these directories' names too.

    Raises:
        InputError: not a readable directory, or far too many meshes.
    """
    left_out: list[tuple[Path, str]] = []
    by_stem: dict[Path, list[Path]] = defaultdict(list)
    root = directory.resolve()
    for path in sorted(directory.rglob("*")):
        if path.suffix[1:].lower() not in FORMATS or path.is_dir():
            continue
        if not Path(os.path.realpath(path)).is_relative_to(root):  # unlike resolve, takes loops of links
            left_out.append((path, "it is a link that leads out of the directory"))
            continue
        by_stem[path.with_suffix("")].append(path)
        if len(by_stem) > MAX_MESHES:
            raise InputError(f"{directory} holds more than {MAX_MESHES} meshes. Import parts of it.")
    chosen = []
    for files in by_stem.values():
        best = min(files, key=lambda p: _RICHER.index(p.suffix[1:].lower()))
        chosen.append(best)
        why = f"{best.name} is taken: of files of one name only one is, GLB before OBJ, PLY and STL"
        left_out += [(p, why) for p in files if p != best]
    stems = [p.stem.lower() for p in chosen]
    named = []
    for path in chosen:
        alone = stems.count(path.stem.lower()) == 1
        relative = path.relative_to(directory).with_suffix("")
        named.append((path, path.stem if alone else "_".join(relative.parts)))
    return named, left_out
