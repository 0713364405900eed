"""Objects on disk, format `torc-object/1`: one directory per object, named like it.

object.yaml      facts, and which arrays make up which piece and surface (schema: `object_schema.py`)
geometry.npz     visual_0_vertices, visual_0_faces, visual_0_uv, visual_0_normals, piece_0_vertices, ...; no pickle
texture_0.png    one per textured surface
"""

import os
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from torc.errors import InputError
from torc.files.reading import ArraySpec, read_arrays, read_bytes
from torc.geometry.transforms import Pose, make_pose, rotation_from_wxyz
from torc.objects.checks import check_model
from torc.objects.models import CollisionPiece, ObjectModel, Quat, Vec3
from torc.objects.schema import (
    FORMAT,
    MAX_PIECE_VERTICES,
    MAX_YAML_BYTES,
    ObjectFile,
    PieceEntry,
    read_object_file,
)
from torc.objects.visual_files import read_visuals, save_textures, visual_arrays, visual_entries, visual_specs

OBJECT_FILE, GEOMETRY_FILE = "object.yaml", "geometry.npz"
MAX_GEOMETRY_BYTES = 48 * 2**20
"""Packed, and unpacked: all corners, triangles and pieces that are allowed together take 44 million bytes."""
_FAST_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml's, ten times as fast; PyYAML may be built without it."""
_OWN_FILE = re.compile(r"object\.yaml|geometry\.npz|texture_\d+\.png")


@dataclass(frozen=True)
class ObjectSource:
    """Where an imported object comes from. A point p of the mesh file is R(wxyz) (scale * p) + position in the model
    frame.

    Attributes:
        file: the mesh's file name; empty if there is none.
        note: for people, e.g. a licence.
        scale: metres per unit of the mesh file.
        position, wxyz: pose of the scaled mesh's frame in the model frame.
        sha256: of the mesh file; empty if not known.
    """

    file: str = ""
    note: str = ""
    scale: float = 1.0
    position: Vec3 = (0.0, 0.0, 0.0)
    wxyz: Quat = (1.0, 0.0, 0.0, 0.0)
    sha256: str = ""

    @property
    def T_object_mesh(self) -> Pose:
        """Pose of the scaled mesh's frame in the model frame."""
        return make_pose(rotation_from_wxyz(self.wxyz), self.position)


def save_object(
    model: ObjectModel, directory: Path | str, source: ObjectSource | None = None, overwrite: bool = False
) -> None:
    """Write an object to a directory that bears its name; it appears complete or not at all.

    Raises:
        InputError: the directory exists (and not overwrite), is something else, or cannot be written, or the model is
            outside of the format's limits.
    """
    directory = Path(directory)
    if directory.name != model.name:
        raise InputError(
            f"The directory of an object bears its name: {directory} should be .../{model.name}."
        )
    check_replaceable(directory)
    if directory.exists() and not overwrite:
        raise InputError(f"{directory} exists already. Choose another name, or overwrite it.")
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        aside = Path(tempfile.mkdtemp(prefix=".import-", dir=directory.parent))
    except OSError as error:
        raise InputError(f"Cannot write to {directory.parent}: {error.strerror}.") from error
    try:
        written = aside / model.name
        written.mkdir()
        _write(model, written, source or ObjectSource())
        load_object_directory(written)  # nothing is stored that could not be read again
        _put(written, directory, aside / "old")
    except OSError as error:
        raise InputError(f"Cannot write {directory}: {error.strerror}.") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def check_replaceable(directory: Path) -> None:
    """Raises InputError where something lies that is not an object and nothing else: an object must not replace it."""
    if not os.path.lexists(directory):
        return
    plain = directory.is_dir() and not directory.is_symlink()
    if not plain or not all(_OWN_FILE.fullmatch(name) for name in os.listdir(directory)):
        raise InputError(
            f"{directory} is no object, or holds other files besides, so no object replaces it. Give another name, or "
            "keep your objects elsewhere."
        )


def load_object_directory(directory: Path | str, trusted: bool = False) -> ObjectModel:
    """The object in a directory. What only a stranger's can be is not looked for in a trusted one, which takes half as
    long. Raises InputError naming file, field and remedy."""
    directory = Path(directory)
    if trusted:  # some installers link the files of a package, and links are refused below
        directory = (directory / OBJECT_FILE).resolve().parent
    entry = _trusted_entry(directory) if trusted else read_entry(directory)
    arrays = read_arrays(directory / GEOMETRY_FILE, _specs(entry), MAX_GEOMETRY_BYTES, "an object's geometry")
    pieces = tuple(_piece(i, p, arrays) for i, p in enumerate(entry.pieces))
    model = ObjectModel(
        name=entry.name,
        kind=entry.kind,
        description=entry.description,
        mass_kg=entry.mass_kg,
        pieces=pieces,
        visuals=read_visuals(entry.visuals, arrays, directory),
        size_m=entry.size_m,
        rolls=entry.rolls,
        friction=entry.friction,
        held_out=entry.held_out,
    )
    if not trusted:
        check_model(model, directory)
    return model


def read_entry(directory: Path) -> ObjectFile:
    """The validated object.yaml of a directory: facts without geometry. Raises InputError."""
    path = directory / OBJECT_FILE
    try:
        text = read_bytes(path, MAX_YAML_BYTES, "an object's description").decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not UTF-8 text: {error.reason} at byte {error.start}.") from None
    entry = read_object_file(text, str(path))
    if entry.name != directory.name:
        raise InputError(
            f"{path}: the object is called '{entry.name}', its directory '{directory.name}'. Give both one name."
        )
    return entry


def _trusted_entry(directory: Path) -> ObjectFile:
    return ObjectFile.model_validate(yaml.load((directory / OBJECT_FILE).read_bytes(), Loader=_FAST_LOADER))


def load_source(directory: Path | str) -> ObjectSource:
    """Where the object in a directory comes from. Raises InputError."""
    found = read_entry(Path(directory)).source
    return ObjectSource(found.file, found.note, found.scale, found.position, found.wxyz, found.sha256)


def _put(written: Path, directory: Path, old: Path) -> None:
    """Moves the new directory to its place; what was there goes to `old`, or stays if that fails."""
    if not directory.exists():
        written.rename(directory)
        return
    directory.rename(old)
    try:
        written.rename(directory)
    except OSError:
        old.rename(directory)
        raise


def _write(model: ObjectModel, directory: Path, source: ObjectSource) -> None:
    arrays = visual_arrays(model.visuals)
    for i, piece in enumerate(model.pieces):
        if piece.vertices is not None:
            arrays[f"piece_{i}_vertices"] = np.ascontiguousarray(piece.vertices, dtype=np.float64)
    save_textures(model.visuals, directory)
    np.savez_compressed(directory / GEOMETRY_FILE, **arrays)  # type: ignore[arg-type]
    text = yaml.safe_dump(
        _entry(model, source), sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    (directory / OBJECT_FILE).write_text(text, encoding="utf-8")


def _entry(model: ObjectModel, source: ObjectSource) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "name": model.name,
        "kind": model.kind,
        "description": model.description,
        "mass_kg": float(model.mass_kg),
        "friction": float(model.friction),
        "rolls": bool(model.rolls),
        "held_out": bool(model.held_out),
        "size_m": _plain(model.size_m),
        "source": {
            "file": source.file,
            "sha256": source.sha256,
            "note": source.note,
            "scale": float(source.scale),
            "position": _plain(source.position),
            "wxyz": _plain(source.wxyz),
        },
        "pieces": [
            {
                "kind": p.kind,
                "size": _plain(p.size),
                "position": _plain(p.position),
                "wxyz": _plain(p.wxyz),
                "relative_density": float(p.relative_density),
            }
            for p in model.pieces
        ],
        "visuals": visual_entries(model.visuals),
    }


def _plain(values: Any) -> list[float]:
    return [float(v) for v in values]


def _specs(entry: ObjectFile) -> dict[str, ArraySpec]:
    """Which arrays an object must have."""
    pieces = {
        f"piece_{i}_vertices": ArraySpec("f", 3, MAX_PIECE_VERTICES)
        for i, piece in enumerate(entry.pieces)
        if piece.kind == "mesh"
    }
    return {**pieces, **visual_specs(entry.visuals)}


def _piece(i: int, entry: PieceEntry, arrays: dict[str, np.ndarray]) -> CollisionPiece:
    return CollisionPiece(
        entry.kind,
        entry.size,
        entry.position,
        entry.wxyz,
        arrays.get(f"piece_{i}_vertices"),
        entry.relative_density,
    )
