"""Store objects on disk, format `torc-object/1`: one directory per object, with its name.

object.yaml      facts, and which arrays make up which piece and surface (schema: `torc.objects.schema`)
geometry.npz     visual_0_vertices, visual_0_faces, visual_0_uv, visual_0_normals, piece_0_vertices, ...; no pickle
texture_0.png    one per textured surface
"""

import io
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml
from jaxtyping import UInt8
from PIL import Image

from torc.errors import InputError
from torc.io.reading import read_bytes
from torc.io.strict_yaml import FAST_LOADER, parse_plain_yaml, validated
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh, pieces_bounds
from torc.objects.schema import (
    FORMAT,
    MAX_FACES,
    MAX_PIECE_VERTICES,
    MAX_SIZE_M,
    MAX_TEXTURE_PX,
    MAX_VERTICES,
    MAX_YAML_BYTES,
    MIN_SIZE_M,
    ObjectFile,
    ObjectSource,
    PieceEntry,
    VisualEntry,
)

OBJECT_FILE, GEOMETRY_FILE = "object.yaml", "geometry.npz"
MAX_GEOMETRY_BYTES, MAX_PNG_BYTES = 48 * 2**20, 32 * 2**20
_FACTS = ("name", "kind", "description", "mass_kg", "friction", "rolls", "held_out", "size_m")
"""Fields that a model and its file share."""
_INVALID = f"is not a valid object ({FORMAT})"
_MAX_NUMBER = 1e30
"""Larger numbers do not fit the single precision of physics and pictures."""
_FRAME_TOLERANCE_M = 1e-5
_MIN_VOLUME_M3, _MIN_THICKNESS_M = 1e-12, 1e-5
_LEAST_M2, _MOST_M2 = MIN_SIZE_M**2, 12.0
"""Limits of all surfaces together: a side of the smallest thing, and a cube of 1 m from both sides. Grasp planning
takes a sample every 2.5 mm2.
"""


def save_object(
    model: ObjectModel, directory: Path | str, source: ObjectSource | None = None, overwrite: bool = False
) -> None:
    """Write an object to a directory of its name, completely or not at all.

    Raises InputError if the directory exists (and not overwrite), is not an object's, or cannot be written, or the
    model is outside the limits.
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
        with tempfile.TemporaryDirectory(prefix=".import-", dir=directory.parent) as aside:
            written = Path(aside) / model.name
            written.mkdir()
            _write(model, written, source or ObjectSource())
            load_object_directory(written)  # nothing is stored that could not be read again
            if directory.exists():
                directory.rename(Path(aside) / "old")
            written.rename(directory)
    except OSError as error:
        raise InputError(f"Cannot write {directory}: {error.strerror}.") from error


def check_replaceable(directory: Path) -> None:
    """Raise InputError if something other than an object is there."""
    if directory.exists() and not (directory / OBJECT_FILE).is_file():
        raise InputError(f"{directory} is no object, so no object replaces it. Give another name.")


def load_object_directory(directory: Path | str, trusted: bool = False) -> ObjectModel:
    """Load the object in a directory.

    A trusted one skips the checks against strangers' files, and takes half the time. Raises InputError naming file,
    field and remedy.
    """
    directory = Path(directory)
    if trusted:  # some installers link the files of a package, and links are refused below
        directory = (directory / OBJECT_FILE).resolve().parent
        text = (directory / OBJECT_FILE).read_bytes()
        entry = ObjectFile.model_validate(yaml.load(text, Loader=FAST_LOADER))
    else:
        entry = read_entry(directory)
    arrays = _Arrays(directory / GEOMETRY_FILE)
    pieces = tuple(
        CollisionPiece(
            **piece.model_dump(),
            vertices=arrays.rows(f"piece_{i}_vertices", 3, MAX_PIECE_VERTICES)
            if piece.kind == "mesh"
            else None,
        )
        for i, piece in enumerate(entry.pieces)
    )
    visuals = tuple(arrays.visual(i, visual) for i, visual in enumerate(entry.visuals))
    model = ObjectModel(**{name: getattr(entry, name) for name in _FACTS}, pieces=pieces, visuals=visuals)
    if not trusted:
        check_model(model, directory)
    return model


def read_entry(directory: Path) -> ObjectFile:
    """Return the validated object.yaml of a directory: facts without geometry. Raises InputError."""
    path = directory / OBJECT_FILE
    text = read_bytes(path, MAX_YAML_BYTES, "an object's description").decode("utf-8-sig", "backslashreplace")
    content = parse_plain_yaml(text, str(path), "object", MAX_YAML_BYTES, "Import the object again.")
    entry = validated(ObjectFile, content, f"{path} {_INVALID}")
    if entry.name != directory.name:
        raise InputError(
            f"{path}: the object is called '{entry.name}', its directory '{directory.name}'. Give both one name."
        )
    return entry


def load_source(directory: Path | str) -> ObjectSource:
    """Return where the object in a directory comes from. Raises InputError."""
    return read_entry(Path(directory)).source


def _write(model: ObjectModel, directory: Path, source: ObjectSource) -> None:
    arrays, visuals = {}, []
    for i, visual in enumerate(model.visuals):
        for key in ("vertices", "faces", "uv", "normals"):
            if (values := getattr(visual, key)) is not None:
                dtype = np.int32 if key == "faces" else np.float64
                arrays[f"visual_{i}_{key}"] = np.ascontiguousarray(values, dtype)
        texture = None if visual.texture is None else f"texture_{i}.png"
        if visual.texture is not None:
            Image.fromarray(visual.texture).save(directory / f"texture_{i}.png")
        has = {"uv": visual.uv is not None, "normals": visual.normals is not None}
        visuals.append({"rgba": visual.rgba, "texture": texture, **has})
    for i, piece in enumerate(model.pieces):
        if piece.vertices is not None:
            arrays[f"piece_{i}_vertices"] = np.ascontiguousarray(piece.vertices, dtype=np.float64)
    np.savez_compressed(directory / GEOMETRY_FILE, **arrays)  # type: ignore[arg-type]
    facts = {name: getattr(model, name) for name in _FACTS}
    pieces = [{name: getattr(piece, name) for name in PieceEntry.model_fields} for piece in model.pieces]
    content = {"format": FORMAT, **facts, "source": source, "pieces": pieces, "visuals": visuals}
    entry = validated(ObjectFile, content, f"'{model.name}' {_INVALID}").model_dump(mode="json")
    text = yaml.safe_dump(entry, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True)
    (directory / OBJECT_FILE).write_text(text, encoding="utf-8")


class _Arrays:
    """The arrays of an object's geometry.npz, without pickle. Raises InputError."""

    def __init__(self, path: Path) -> None:
        self._path = path
        data = io.BytesIO(read_bytes(path, MAX_GEOMETRY_BYTES, "an object's geometry"))
        try:
            with np.load(data, allow_pickle=False) as arrays:
                self._arrays = dict(arrays)
        except Exception as error:  # numpy and zipfile raise anything for damaged files
            raise InputError(f"{path} is not a readable .npz file: {error}.") from None

    def rows(self, name: str, columns: int, most: int, kind: str = "f") -> np.ndarray:
        """Return an array of finite numbers with 1 to `most` rows."""
        array = np.asarray(self._arrays.get(name))
        if array.dtype.kind != kind or array.shape[1:] != (columns,) or not 0 < len(array) <= most:
            raise InputError(
                f"{self._path}, array {name} is missing, or not of kind '{kind}' with 1 to {most} rows of {columns}."
            )
        if not (np.abs(array) < _MAX_NUMBER).all():
            raise InputError(f"{self._path}, array {name} holds numbers that are not finite, or huge.")
        return array if kind == "i" else array.astype(np.float64)

    def visual(self, i: int, entry: VisualEntry) -> VisualMesh:
        """Return a surface, with its texture."""
        vertices = self.rows(f"visual_{i}_vertices", 3, MAX_VERTICES)
        uv = self.rows(f"visual_{i}_uv", 2, MAX_VERTICES) if entry.uv else None
        normals = self.rows(f"visual_{i}_normals", 3, MAX_VERTICES) if entry.normals else None
        if any(rows is not None and len(rows) != len(vertices) for rows in (uv, normals)):
            raise InputError(
                f"{self._path}: visual_{i}_uv and visual_{i}_normals must have one row per vertex."
            )
        faces = self.rows(f"visual_{i}_faces", 3, MAX_FACES, "i")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(
                f"{self._path}, array visual_{i}_faces points beyond the {len(vertices)} vertices."
            )
        texture = None if entry.texture is None else _texture(self._path.with_name(entry.texture))
        return VisualMesh(vertices, faces.astype(np.int32), uv, texture, entry.rgba, normals)


def _texture(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """Return a PNG's colours, dropping transparency. Raises InputError."""
    data = io.BytesIO(read_bytes(path, MAX_PNG_BYTES, "a texture"))
    try:
        with Image.open(data, formats=("PNG",)) as image:
            if max(image.size) > MAX_TEXTURE_PX:
                raise ValueError(f"its sides have at most {MAX_TEXTURE_PX} pixels, not {image.size}")
            return np.array(image.convert("RGB"))
    except Exception as error:  # Pillow raises anything for damaged files
        raise InputError(f"{path} is no readable picture (PNG): {error}. Save it anew as a PNG.") from None


def check_model(model: ObjectModel, directory: Path) -> None:
    """Raise InputError if the physics would reject the object, or its frame is off."""
    for fault in _faults(model):
        raise InputError(f"{directory}: {fault} Import the mesh again.")


def _faults(model: ObjectModel) -> Iterator[str]:
    for i, piece in enumerate(model.pieces):
        if piece.vertices is not None and np.abs(piece.vertices).max() > 2 * MAX_SIZE_M:
            yield f"the corners of pieces[{i}] lie far from its own frame."
        if not _is_solid(piece):
            yield f"pieces[{i}] is flat or degenerate; a piece must enclose a volume."
    lower, upper = pieces_bounds(model.pieces)
    if np.abs(lower + upper).max() > 2 * _FRAME_TOLERANCE_M:
        center = ((lower + upper) / 2).round(5).tolist()
        yield f"the pieces' bounding box is centred at {center}, not at the origin."
    if np.abs(upper - lower - model.size_m).max() > 2 * _FRAME_TOLERANCE_M:
        yield f"size_m is {list(model.size_m)}, but the pieces measure {(upper - lower).round(5).tolist()}."
    if np.abs(np.concatenate([v.vertices for v in model.visuals])).max() > 2.0 * max(model.size_m):
        yield "the visible surface reaches far beyond the contact pieces."
    corners = np.concatenate([v.vertices[v.faces] for v in model.visuals])
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area_m2 = 0.5 * float(np.linalg.norm(cross, axis=1).sum())
    if not _LEAST_M2 <= area_m2 <= _MOST_M2:
        yield f"its surfaces have {area_m2:.2g} m2 in all; it must be {_LEAST_M2:.2g} to {_MOST_M2:g}."


def _is_solid(piece: CollisionPiece) -> bool:
    from scipy.spatial import QhullError

    try:
        return piece.volume_m3 > _MIN_VOLUME_M3 and piece.thickness_m > _MIN_THICKNESS_M
    except (QhullError, ValueError):
        return False
