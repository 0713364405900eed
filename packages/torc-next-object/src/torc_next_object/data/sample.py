"""A few decisions that come with torc, so that a model can be tried at once: no download, nothing to make."""

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

from torc_next_object.schema import NAME, NextObjectRow

SAMPLE = "sample"
"""Names these decisions where a data set is named."""
CAVEAT = "They are a sample for trying things: a score to publish takes the whole data set."
_FILE = "sample.zip"
_ROWS, _ABOUT = "decisions.jsonl", "README.md"


def sample_rows() -> list[dict[str, Any]]:
    """Return the decisions as plain data, pictures as files. They have no plain picture, which nobody is sent."""
    with (files("torc_next_object") / _FILE).open("rb") as opened, ZipFile(opened) as archive:
        lines = archive.read(_ROWS).decode("utf-8").splitlines()
        return [_with_pictures(json.loads(line), archive) for line in lines]


def _with_pictures(row: dict[str, Any], archive: ZipFile) -> dict[str, Any]:
    pictures = {"image": archive.read(row["image"]), "image_plain": b""}
    return {**row, **pictures, "references": [archive.read(name) for name in row["references"]]}


def write_sample(rows: Sequence[NextObjectRow], path: Path) -> None:
    """Write rows in the form that `sample_rows` reads. The file's bytes depend on the rows alone."""
    with ZipFile(path, "w") as archive:
        lines = []
        for row in sorted(rows, key=lambda row: row.id):
            names = [f"{row.id}_target_{i}.jpg" for i, _ in enumerate(row.references, start=1)]
            pictures = {f"{row.id}.jpg": row.image, **dict(zip(names, row.references, strict=True))}
            for name, picture in pictures.items():
                archive.writestr(_entry(name, ZIP_STORED), picture)
            lines.append(json.dumps({**row.facts_only(), "image": f"{row.id}.jpg", "references": names}))
        archive.writestr(_entry(_ROWS, ZIP_DEFLATED), "\n".join(lines) + "\n")
        archive.writestr(_entry(_ABOUT, ZIP_DEFLATED), _about(rows))


def _entry(name: str, compression: int) -> ZipInfo:
    """Without the time at which it was written."""
    entry = ZipInfo(name)
    entry.compress_type, entry.external_attr = compression, 0o644 << 16
    return entry


def _about(rows: Sequence[NextObjectRow]) -> str:
    hidden = sum(row.target_hidden for row in rows)
    return (
        f"# {NAME}: a sample\n\n{len(rows)} decisions of {len({row.scene for row in rows})} problems, all of the split "
        f"test of {NAME}; the target is out of sight in {hidden}. {CAVEAT} MIT licence.\n"
    )
