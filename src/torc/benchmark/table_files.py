"""The table of a benchmark in two files: CSV, which is read again, and Parquet where DuckDB is installed.

They are small enough to keep where the trials are not, with all that a report counts.
"""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter

from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.errors import InputError
from torc.scenes.strict_files import read_bytes

TRIALS_FILE, PICKS_FILE = "trials.csv", "picks.csv"
_NESTED = ("directory", "picked")
_KEY = ("planner", "problem", "seed")
_MAX_BYTES = 512 * 2**20
_Row = TypeVar("_Row")


def trial_records(table: Table) -> list[dict[str, Any]]:
    """A flat record per trial, its sums of seconds and picks among them."""
    plain = [f.name for f in fields(TrialRow) if f.name not in _NESTED]
    return [
        {
            **{name: getattr(row, name) for name in plain},
            "cost": row.cost,
            "decision_s": round(sum(p.decision_s for p in row.picked), 4),
            "planning_s": round(sum(p.planning_s for p in row.picked), 4),
            "grasps_tried": sum(p.grasp_tried for p in row.picked),
            "grasps_held": sum(p.held for p in row.picked if p.grasp_tried),
            "directory": row.directory.relative_to(table.root).as_posix(),
        }
        for row in table.rows
    ]


def pick_records(table: Table) -> list[dict[str, Any]]:
    """A flat record per attempt of all completed trials."""
    names = [f.name for f in fields(PickRow)]
    return [
        {**{k: getattr(row, k) for k in _KEY}, **{n: getattr(pick, n) for n in names}}
        for row in table.rows
        for pick in row.picked
    ]


def write_tables(table: Table, directory: Path) -> list[Path]:
    """trials.csv and picks.csv, and the same as Parquet where DuckDB is there; the files."""
    written = []
    for name, records in ((TRIALS_FILE, trial_records(table)), (PICKS_FILE, pick_records(table))):
        if records:
            path = directory / name
            _write_csv(path, records)
            written.append(path)
            written += _as_parquet(path)
    return written


def holds_tables(directory: Path) -> bool:
    """Whether `write_tables` wrote to it."""
    return (directory / TRIALS_FILE).is_file()


def read_rows(directory: Path) -> list[TrialRow]:
    """What `write_tables` wrote.

    Raises:
        InputError: a file is too large or was not written by it; names the row.
    """
    picked: dict[tuple[str, ...], list[PickRow]] = {}
    if (directory / PICKS_FILE).is_file():
        for record, pick in _records(directory / PICKS_FILE, _PICK):
            picked.setdefault(tuple(record[name] for name in _KEY), []).append(pick)
    return [
        replace(
            row,
            directory=directory / row.directory,
            picked=tuple(picked.get(tuple(record[name] for name in _KEY), ())),
        )
        for record, row in _records(directory / TRIALS_FILE, _TRIAL)
    ]


_PICK, _TRIAL = TypeAdapter(PickRow), TypeAdapter(TrialRow)


def _records(path: Path, kind: TypeAdapter[_Row]) -> Iterator[tuple[dict[str, str], _Row]]:
    """Each row as text, and as what it is."""
    text = read_bytes(path, _MAX_BYTES, "the table of a benchmark").decode("utf-8", "replace")
    for number, record in enumerate(csv.DictReader(io.StringIO(text, newline="")), start=2):
        try:
            yield record, kind.validate_python({k: v for k, v in record.items() if v != ""} | _blank(record))
        except (ValueError, AttributeError) as error:
            problem = str(error).splitlines()[0]
            raise InputError(
                f"{path}, row {number}: {problem}. It was not written by `torc report`."
            ) from None


def _blank(record: Mapping[str, str]) -> dict[str, Any]:
    """Empty cells: unknown where that is a value, else empty text."""
    return {k: None if k == "unseen_kind" else "" for k, v in record.items() if v == ""}


def _write_csv(path: Path, records: Sequence[Mapping[str, Any]]) -> None:
    with open(path, "w", newline="", encoding="utf-8") as f:
        writer = csv.DictWriter(f, fieldnames=list(records[0]))
        writer.writeheader()
        writer.writerows(records)


def _as_parquet(path: Path) -> list[Path]:
    try:
        import duckdb
    except ImportError:
        return []
    target = path.with_suffix(".parquet")
    with duckdb.connect() as connection:
        rows = connection.read_csv(str(path), sample_size=-1, all_varchar=False)
        rows.write_parquet(str(target))
    return [target]
