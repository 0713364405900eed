"""Rows to ask about: from a folder of Parquet files, from the Hugging Face hub, or the sample that comes with torc."""

import os
import shlex
from pathlib import Path
from typing import Any

from torc import InputError
from torc.errors import MissingDependencyError, extra_remedy
from torc_next_object.data.sample import SAMPLE, sample_rows
from torc_next_object.schema import COLUMNS, PICTURES

VARIABLE = "TORC_NEXT_OBJECT"
"""Environment variable with the folder, or the hub's OWNER/NAME, for harnesses that are not told it otherwise."""


def open_rows(source: str | Path | None = None, split: str = "test") -> list[dict[str, Any]]:
    """Return the rows of a split as plain data, pictures as files, in the order of the files. The source SAMPLE is what
    comes with torc; without a source, VARIABLE names it. Raises InputError where there are none.
    """
    named = str(source) if source is not None else os.environ.get(VARIABLE, "")
    if not named:
        raise InputError(
            f"Which data set? Name its folder, or OWNER/NAME on the Hugging Face hub, or '{SAMPLE}' for the decisions "
            f"that come with torc; or set {VARIABLE}."
        )
    if named == SAMPLE:
        rows = [row for row in sample_rows() if row["split"] == split]
    else:
        path = Path(named).expanduser()
        rows = _in_folder(path, split) if path.exists() else _on_hub(named, split)
    if not rows:
        raise InputError(f"'{named}' has no decisions in its split '{split}'.")
    return [_plain(row, named) for row in rows]


def _in_folder(path: Path, split: str) -> list[dict[str, Any]]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise MissingDependencyError("pyarrow", extra_remedy("next-object")) from None
    files = [path] if path.is_file() else sorted(path.rglob("*.parquet"))
    if not files:
        raise InputError(f"'{path}' holds no Parquet files; `torc next-object make` writes some.")
    rows: list[dict[str, Any]] = []
    for file in files:
        try:
            rows += parquet.read_table(file, filters=[("split", "=", split)]).to_pylist()
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"'{file}' is no readable data set: {' '.join(str(error).split())}.") from None
    return rows


def _on_hub(name: str, split: str) -> list[dict[str, Any]]:
    if name.count("/") != 1 or name.startswith((".", "/", "~")):
        raise InputError(
            f"There is no data set '{name}'. '{SAMPLE}' names the decisions that come with torc (without --data, torc "
            "vlm-eval takes them). Or make 60 others: torc next-object make --problems torc40 --decisions 60 --out "
            f"{shlex.quote(name)} (much quicker in a checkout of torc, with --values results/next-object/values.jsonl "
            "--looks 0)."
        )
    try:
        import datasets
    except ImportError:
        raise MissingDependencyError("datasets", "pip install datasets") from None
    found = datasets.load_dataset(name, split=split)
    for column in PICTURES:
        kind = found.features[column]
        undecoded = datasets.Image(decode=False)
        found = found.cast_column(
            column, undecoded if isinstance(kind, datasets.Image) else datasets.List(undecoded)
        )
    return list(found)


def _plain(row: dict[str, Any], source: str) -> dict[str, Any]:
    missing = [name for name in COLUMNS if name not in row]
    if missing:
        raise InputError(f"'{source}' is another kind of data: its rows have no {', '.join(missing)}.")
    one = {name: _bytes(row[name]) for name in ("image", "image_plain")}
    return {**row, **one, "references": [_bytes(picture) for picture in row["references"] or ()]}


def _bytes(picture: Any) -> bytes:
    found = picture["bytes"] if isinstance(picture, dict) else picture
    return bytes(found) if found is not None else b""
