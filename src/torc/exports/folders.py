"""A Hugging Face imagefolder: a directory per split, with pictures and a line of metadata for each."""

import json
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torc.exports.selection import SPLITS
from torc.records.directories import check_place, claim

_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")


@dataclass(frozen=True)
class Row:
    """One example.

    Attributes:
        split: "train" or "test".
        problem: of which problem.
        name: of its picture, without ending.
        picture: PNG.
        facts: the other columns, JSON-compatible; every row has the same keys.
    """

    split: str
    problem: str
    name: str
    picture: bytes
    facts: dict[str, Any]


@contextmanager
def new_directory(out: Path, overwrite: bool, mark: str) -> Iterator[Path]:
    """A directory to fill; it gets the name `out` when the block ends well, and is removed when it does not.

    Args:
        out: the directory.
        overwrite: replace one with `mark` in it.
        mark: a file that each such directory holds.

    Raises:
        InputError: `out` exists (and not overwrite), is something else, or cannot be written.
    """
    check_place(out, overwrite, mark, "export")
    aside = out.with_name(f".{out.name}.partial")
    with claim(aside, "lock", "unfinished export"):
        try:
            partial = aside / out.name
            partial.mkdir()
            yield partial
            if out.exists():
                os.replace(out, aside / "replaced")
            os.replace(partial, out)
        finally:
            shutil.rmtree(aside, ignore_errors=True)


def write_rows(directory: Path, rows: Iterator[Row]) -> dict[str, int]:
    """Writes `<split>/<name>.png` and `<split>/metadata.jsonl`; a split without rows gets no directory.

    Returns:
        How many rows each split has.
    """
    counts = dict.fromkeys(SPLITS, 0)
    for row in rows:
        folder = directory / row.split
        folder.mkdir(exist_ok=True)
        file_name = _UNSAFE.sub("-", row.name) + ".png"
        (folder / file_name).write_bytes(row.picture)
        line = {"file_name": file_name, "problem": row.problem, **row.facts}
        with open(folder / "metadata.jsonl", "a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")
        counts[row.split] += 1
    return counts
