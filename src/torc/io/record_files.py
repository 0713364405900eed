"""Records to files and back, without pickle: one .npz holds the arrays and a JSON tree for everything else."""

import dataclasses
import enum
import json
import os
import types
import typing
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import AbstractArray, jaxtyped

from torc.errors import InputError

FORMAT = "torc-record/1"
MAX_ARRAY_BYTES = 512 * 2**20
"""Most bytes of the arrays of a file together, unpacked, where no other limit is given."""
ASIDE: Mapping[str, Any] = types.MappingProxyType({"aside": True})
"""Metadata of a field that `to_plain` leaves out: it is written beside the log."""
_GONE = {"Observation": ("label_image",)}
"""By record, fields of older files that are skipped: observations had labels before 0.2."""
Record = TypeVar("Record")


def save_record(record: Any, path: Path | str) -> None:
    """Write a record atomically: to a temporary file beside `path`, then renamed. Raises TypeError if not plain data.

    Arrays keep dtype and shape bit for bit; nested records, tuples, enums and None are kept.
    """
    path = Path(path)
    arrays: dict[str, np.ndarray] = {}
    tree = {"format": FORMAT, "type": type(record).__name__, "fields": _encode(record, "", arrays)}
    temporary = path.with_name(path.name + ".tmp")
    # The fastest compression: files of np.savez_compressed are a sixth smaller, and take twice the time.
    with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in {"__tree__": np.array(json.dumps(tree)), **arrays}.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as f:
                np.lib.format.write_array(f, array, allow_pickle=False)
    os.replace(temporary, path)


def read_arrays(path: Path | str, max_bytes: int | None = None) -> dict[str, np.ndarray]:
    """Read all arrays of a .npz, at most `max_bytes` unpacked; they are not unpacked before. Raises InputError."""
    most = MAX_ARRAY_BYTES if max_bytes is None else max_bytes
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > most:
                raise InputError(f"'{path}' is larger than {most // 2**20} MB unpacked.")
        with np.load(path, allow_pickle=False) as data:
            return dict(data)
    except (OSError, zipfile.BadZipFile, EOFError, MemoryError, ValueError) as error:
        hint = "Python objects are not read; store plain arrays" if "pickle" in str(error) else str(error)
        raise InputError(f"'{path}' is not a readable .npz file: {hint}.") from error


def load_record(path: Path | str, cls: type[Record], max_bytes: int | None = None) -> Record:
    """Read a record of type `cls`. Raises InputError if the file is missing, damaged or holds another record."""
    arrays = read_arrays(path, max_bytes)
    try:
        tree = json.loads(str(arrays.pop("__tree__", "")))
    except ValueError:
        tree = None
    if not isinstance(tree, dict) or tree.get("format") != FORMAT or tree.get("type") != cls.__name__:
        raise InputError(f"'{path}' does not hold a {cls.__name__} in the format {FORMAT}.")
    try:
        return _decode(cls, tree["fields"], arrays)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"'{path}' does not hold a complete {cls.__name__}: {error}") from error


def load_checked(path: Path, cls: type[Record], max_bytes: int, what: str) -> Record:
    """Read a record from an untrusted file.

    Like `load_record`; `what` names the file in errors. Its arrays must be finite and of the annotated types and
    shapes, and at most `max_bytes` unpacked.
    """
    record = load_record(path, cls, max_bytes)
    if not _fits(record):
        raise InputError(f"'{path}' holds no {what}: its arrays are not as torc writes them.")
    return record


def to_plain(value: Any) -> Any:
    """Return a record as JSON-compatible data, arrays as nested lists (for logs of small records)."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        kept = [f.name for f in dataclasses.fields(value) if "aside" not in f.metadata]
        return {name: to_plain(getattr(value, name)) for name in kept}
    if isinstance(value, Mapping):
        return {str(k): to_plain(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(v) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value.value if isinstance(value, enum.Enum) else value


def _fits(record: Any) -> bool:
    """True if a record's arrays, and those of nested records, are as annotated, with equal sizes for equal names."""
    with jaxtyped("context"):
        for name, kind in typing.get_type_hints(type(record)).items():
            value = getattr(record, name)
            if not isinstance(kind, type):
                continue
            if dataclasses.is_dataclass(kind) and not (isinstance(value, kind) and _fits(value)):
                return False
            if issubclass(kind, AbstractArray) and not (
                isinstance(value, kind) and np.isfinite(np.asarray(value)).all()
            ):
                return False
    return True


def _encode(value: Any, key: str, arrays: dict[str, np.ndarray]) -> Any:
    if isinstance(value, np.ndarray):
        name = f"a{len(arrays)}{key}"
        arrays[name] = value
        return {"array": name}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            f.name: _encode(getattr(value, f.name), f"{key}.{f.name}", arrays)
            for f in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {"map": to_plain(value)}
    if isinstance(value, tuple | list):
        return [_encode(v, key, arrays) for v in value]
    plain = to_plain(value)
    if plain is None or isinstance(plain, bool | int | float | str):
        return plain
    raise TypeError(
        f"A record holds plain data only, not {type(value).__name__} (field '{key.lstrip('.')}')."
    )


def _decode(annotation: Any, value: Any, arrays: dict[str, np.ndarray]) -> Any:
    if isinstance(value, dict) and set(value) == {"array"}:
        return arrays[value["array"]]
    if isinstance(value, dict) and set(value) == {"map"}:
        return types.MappingProxyType(value["map"])
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        if value is None:
            return None
        return _decode(next(a for a in args if a is not type(None)), value, arrays)
    if origin is tuple:
        items = args[:1] * len(value) if len(args) == 2 and args[1] is Ellipsis else args
        return tuple(_decode(a, v, arrays) for a, v in zip(items, value, strict=True))
    if dataclasses.is_dataclass(annotation) and isinstance(annotation, type):
        hints, gone = typing.get_type_hints(annotation), _GONE.get(annotation.__name__, ())
        if unknown := set(value) - {*hints, *gone}:
            raise ValueError(f"unknown fields: {', '.join(sorted(unknown))}")
        # Fields with a default may be younger than the file.
        return annotation(**{n: _decode(hints[n], v, arrays) for n, v in value.items() if n in hints})
    if isinstance(annotation, type) and issubclass(annotation, enum.Enum):
        return annotation(value)
    return value
