"""Rows as Parquet files that the library `datasets` and the Hugging Face hub read, pictures inside."""

import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from torc import InputError
from torc.errors import MissingDependencyError, extra_remedy
from torc_next_object.schema import FEATURES, PICTURES, NextObjectRow, row_from

DATA = "data"
_KINDS = {"string": "string", "int32": "int32", "bool": "bool_", "float64": "float64"}
_GROUP_ROWS = 64


def write_rows(path: Path, rows: Sequence[NextObjectRow]) -> None:
    """One file, which appears whole or not at all. Raises MissingDependencyError without pyarrow."""
    pa, parquet = _arrow()
    table = pa.Table.from_pylist([_for_parquet(row) for row in rows], schema=arrow_schema())
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.tmp")
    parquet.write_table(table, aside, row_group_size=_GROUP_ROWS, compression="zstd")
    os.replace(aside, path)


def write_splits(directory: Path, rows: Iterable[NextObjectRow]) -> dict[str, int]:
    """A file for each split, rows in the order of their ids, which tells nothing; rows per split."""
    by_split: dict[str, list[NextObjectRow]] = {}
    for row in sorted(rows, key=lambda row: row.id):
        by_split.setdefault(row.split, []).append(row)
    for split, some in by_split.items():
        write_rows(directory / DATA / f"{split}.parquet", some)
    return {split: len(some) for split, some in sorted(by_split.items())}


def read_rows(source: Path) -> list[NextObjectRow]:
    """The rows of a file, or of all files of a directory, by their names. Raises InputError where there are none, or
    one cannot be read.
    """
    pa, parquet = _arrow()
    files = [source] if source.is_file() else sorted(source.rglob("*.parquet"))
    if not files:
        raise InputError(f"'{source}' holds no Parquet files; `torc next-object make` writes some.")
    rows: list[NextObjectRow] = []
    for file in files:
        try:
            rows += [row_from(plain) for plain in parquet.read_table(file).to_pylist()]
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(f"'{file}' cannot be read: {' '.join(str(error).split())}") from None
    return rows


def declared(file: Path) -> dict[str, Any]:
    """The features that a file declares; empty where it declares none."""
    _, parquet = _arrow()
    told = (parquet.read_schema(file).metadata or {}).get(b"huggingface", b"{}")
    found: dict[str, Any] = json.loads(told).get("info", {}).get("features", {})
    return found


def arrow_schema() -> Any:
    """Types of all columns, with what `datasets` is told of them."""
    pa, _ = _arrow()
    picture = pa.struct([("bytes", pa.binary()), ("path", pa.string())])

    def kind(feature: Any) -> Any:
        if feature["_type"] == "List":
            return pa.list_(kind(feature["feature"]))
        return picture if feature["_type"] == "Image" else getattr(pa, _KINDS[feature["dtype"]])()

    told = json.dumps({"info": {"features": FEATURES}})
    return pa.schema([(name, kind(f)) for name, f in FEATURES.items()], metadata={"huggingface": told})


def _for_parquet(row: NextObjectRow) -> dict[str, Any]:
    plain = row.to_dict()
    for name in PICTURES:
        one = plain[name]
        plain[name] = [_picture(file) for file in one] if isinstance(one, list) else _picture(one)
    return plain


def _picture(file: bytes) -> dict[str, Any]:
    return {"bytes": file, "path": None}


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise MissingDependencyError("pyarrow", extra_remedy("next-object")) from None
    return pa, parquet
