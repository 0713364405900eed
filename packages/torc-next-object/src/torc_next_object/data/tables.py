"""Rows as Parquet files that the library `datasets` and the Hugging Face hub read, pictures inside."""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from torc import InputError
from torc.errors import MissingDependencyError, extra_remedy
from torc_next_object.schema import COLUMNS, FEATURES, PICTURES, NextObjectRow, row_from

DATA = "data"
_GROUP_ROWS = 64


def write_rows(path: Path, rows: Sequence[NextObjectRow]) -> None:
    """Write one file atomically. Raises MissingDependencyError without pyarrow."""
    pa, parquet = _arrow()
    table = pa.Table.from_pylist([_for_parquet(row) for row in rows], schema=arrow_schema())
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.tmp")
    parquet.write_table(table, aside, row_group_size=_GROUP_ROWS, compression="zstd")
    os.replace(aside, path)


def write_splits(directory: Path, rows: Iterable[NextObjectRow]) -> dict[str, int]:
    """Write a file for each split, rows in the order of their ids, which reveals nothing; return rows per split."""
    by_split: dict[str, list[NextObjectRow]] = {}
    for row in sorted(rows, key=lambda row: row.id):
        by_split.setdefault(row.split, []).append(row)
    for split, some in by_split.items():
        write_rows(directory / DATA / f"{split}.parquet", some)
    return {split: len(some) for split, some in sorted(by_split.items())}


def read_rows(source: Path) -> list[NextObjectRow]:
    """Return the rows of a file, or of all files of a directory. Raises InputError as `read_plain`."""
    return [row_from(row) for row in read_plain(source)]


def read_plain(source: Path, split: str = "") -> list[dict[str, Any]]:
    """Return the rows of a file, or of all files of a directory, as plain data; of one split, or of all.

    Raises InputError if there are none, or a file cannot be read.
    """
    pa, parquet = _arrow()
    rows: list[dict[str, Any]] = []
    for file in parquet_files(source):
        try:
            table = parquet.read_table(file, filters=[("split", "=", split)] if split else None)
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"'{file}' cannot be read: {' '.join(str(error).split())}.") from None
        rows += [plain_row(row, str(file)) for row in table.to_pylist()]
    return rows


def parquet_files(source: Path) -> list[Path]:
    """Return the file, or all Parquet files of a directory. Raises InputError if there are none."""
    files = [source] if source.is_file() else sorted(source.rglob("*.parquet"))
    if not files:
        raise InputError(f"'{source}' holds no Parquet files; `torc next-object make` writes some.")
    return files


def plain_row(row: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return a row with its pictures as files. Raises InputError if columns are missing."""
    missing = [name for name in COLUMNS if name not in row]
    if missing:
        raise InputError(f"'{source}' is another kind of data: its rows have no {', '.join(missing)}.")
    return {**row, **{name: _bytes(row[name]) for name in PICTURES}}


def _bytes(picture: Any) -> Any:
    if isinstance(picture, list):
        return [_bytes(one) for one in picture]
    return (picture["bytes"] if isinstance(picture, dict) else picture) or b""


def declared(file: Path) -> dict[str, Any]:
    """Return the features that a file declares; empty if none."""
    _, parquet = _arrow()
    metadata = (parquet.read_schema(file).metadata or {}).get(b"huggingface", b"{}")
    found: dict[str, Any] = json.loads(metadata).get("info", {}).get("features", {})
    return found


def arrow_schema() -> Any:
    """Return the types of all columns, with the features that `datasets` reads."""
    pa, _ = _arrow()
    picture = pa.struct([("bytes", pa.binary()), ("path", pa.string())])

    def kind(feature: Any) -> Any:
        if feature["_type"] == "List":
            return pa.list_(kind(feature["feature"]))
        return picture if feature["_type"] == "Image" else pa.type_for_alias(feature["dtype"])

    features = json.dumps({"info": {"features": FEATURES}})
    return pa.schema([(name, kind(f)) for name, f in FEATURES.items()], metadata={"huggingface": features})


def _for_parquet(row: NextObjectRow) -> dict[str, Any]:
    return row.to_dict() | {
        "image": _picture(row.image),
        "image_plain": _picture(row.image_plain),
        "references": [_picture(file) for file in row.references],
    }


def _picture(file: bytes) -> dict[str, Any]:
    return {"bytes": file, "path": None}


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise MissingDependencyError("pyarrow", extra_remedy("next-object")) from None
    return pa, parquet
