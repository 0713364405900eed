"""Open rows to ask about: from a folder of Parquet files, the Hugging Face hub, or the sample that comes with torc."""

import json
import os
import shlex
from importlib.resources import files
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from torc import InputError
from torc.errors import MissingDependencyError
from torc_next_object.data.tables import plain_row, read_plain
from torc_next_object.schema import PICTURES

SAMPLE = "sample"
"""Names the decisions that come with torc, so that a model can be tried at once."""
CAVEAT = "They are a sample for trying things: a score to publish takes the whole data set."
SAMPLE_FILE, SAMPLE_ROWS = "sample.zip", "decisions.jsonl"
VARIABLE = "TORC_NEXT_OBJECT"
"""Environment variable with the folder, or the hub's OWNER/NAME, for harnesses that are not given it otherwise."""


def open_rows(source: str | Path | None = None, split: str = "test") -> list[dict[str, Any]]:
    """Return the rows of a split as plain data, pictures as files, in the order of the files.

    Args:
        source: a folder or Parquet file, OWNER/NAME on the hub, or SAMPLE; if not given, the value of VARIABLE.
        split: part of the data set.

    Raises:
        InputError: there are no such rows.
        MissingDependencyError: pyarrow, or datasets for the hub, is not installed.
    """
    name = str(source) if source is not None else os.environ.get(VARIABLE, "")
    if not name:
        raise InputError(
            f"Which data set? Name its folder, or OWNER/NAME on the Hugging Face hub, or '{SAMPLE}' for the decisions "
            f"that come with torc; or set {VARIABLE}."
        )
    path = Path(name).expanduser()
    if name == SAMPLE:
        rows = [row for row in sample_rows() if row["split"] == split]
    else:
        rows = read_plain(path, split) if path.exists() else _on_hub(name, split)
    if not rows:
        raise InputError(f"'{name}' has no decisions in its split '{split}'.")
    return rows


def sample_rows() -> list[dict[str, Any]]:
    """Return the decisions that come with torc as plain data. They have no plain picture, which nobody is sent."""
    with (files("torc_next_object") / SAMPLE_FILE).open("rb") as opened, ZipFile(opened) as archive:
        rows = [json.loads(line) for line in archive.read(SAMPLE_ROWS).decode("utf-8").splitlines()]
        for row in rows:
            references = [archive.read(name) for name in row["references"]]
            row |= {"image": archive.read(row["image"]), "image_plain": b"", "references": references}
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
    undecoded = datasets.Image(decode=False)
    for column in PICTURES:
        one = isinstance(found.features[column], datasets.Image)
        found = found.cast_column(column, undecoded if one else datasets.List(undecoded))
    return [plain_row(row, name) for row in found]
