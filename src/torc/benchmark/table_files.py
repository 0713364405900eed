"""The table of a benchmark in two files: CSV, which is read again, and Parquet if pyarrow is installed.

They are small enough to keep without the trials, and hold everything that a report counts.
"""

import csv
import io
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, TypeAdapter

from torc.benchmark.rows import PickRow, Table, TrialRow, participant_by_name
from torc.errors import InputError
from torc.io.reading import read_plain_text
from torc.records import PickResult

TRIALS_FILE, PICKS_FILE = "trials.csv", "picks.csv"
_KEY = ("planner", "problem", "seed")
_MAY_BE_UNKNOWN = ("unseen_kind", "p", "vlm_calls", "tokens_sent", "tokens_written", "vlm_cost")
_MAX_BYTES = 512 * 2**20
_Row = TypeVar("_Row")


def trial_records(table: Table) -> list[dict[str, Any]]:
    """Return a flat record per trial, with its sums of seconds and picks."""
    plain = [f.name for f in fields(TrialRow) if f.name not in ("directory", "picked")]
    records = []
    for row in (*table.rows, *table.beside):
        tried = [p for p in row.picked if p.grasp_tried]
        sums = {
            "cost": row.cost,
            "decision_s": round(sum(p.decision_s for p in row.picked), 4),
            "planning_s": round(sum(p.planning_s for p in row.picked), 4),
            "grasps_tried": len(tried),
            "grasps_held": sum(p.held for p in tried),
            "grasps_delivered": sum(p.delivered for p in tried),
            "directory": row.directory.relative_to(table.root).as_posix(),
        }
        records.append({name: getattr(row, name) for name in plain} | sums)
    return records


def pick_records(table: Table) -> list[dict[str, Any]]:
    """Return a flat record per attempt of all completed trials."""
    return [
        {**{k: getattr(row, k) for k in _KEY}, **asdict(pick)}
        for row in (*table.rows, *table.beside)
        for pick in row.picked
    ]


def write_tables(table: Table, directory: Path) -> None:
    """Write trials.csv and picks.csv, and both as Parquet if pyarrow is installed."""
    for name, records in ((TRIALS_FILE, trial_records(table)), (PICKS_FILE, pick_records(table))):
        if not records:
            continue
        path = directory / name
        with open(path, "w", newline="", encoding="utf-8") as f:
            writer = csv.DictWriter(f, fieldnames=list(records[0]))
            writer.writeheader()
            writer.writerows(records)
        with suppress(ImportError):
            import pyarrow as pa
            from pyarrow import parquet

            parquet.write_table(pa.Table.from_pylist(records), path.with_suffix(".parquet"))


def read_rows(directory: Path) -> list[TrialRow]:
    """Read what `write_tables` wrote.

    Raises InputError naming the row: a file is too large or was not written by it.
    """
    picked: dict[tuple[str, ...], list[PickRow]] = {}
    if (directory / PICKS_FILE).is_file():
        for key, pick in _records(directory / PICKS_FILE, _PICK):
            picked.setdefault(key, []).append(pick)
    return [
        replace(row, directory=directory / row.directory, picked=tuple(picked.get(key, ())))
        for key, row in _records(directory / TRIALS_FILE, _TRIAL)
    ]


def _known(pick: PickRow) -> PickRow:
    PickResult(pick.result)
    return pick


def _below(row: TrialRow) -> TrialRow:
    """Refuse directories outside the table's own: tables may come from strangers."""
    if row.directory.is_absolute() or ".." in row.directory.parts:
        raise ValueError(f"The directory '{row.directory}' leads elsewhere")
    return row


_PICK = TypeAdapter(Annotated[PickRow, AfterValidator(_known)])
_TRIAL = TypeAdapter(Annotated[TrialRow, AfterValidator(_below)])


def _records(path: Path, kind: TypeAdapter[_Row]) -> Iterator[tuple[tuple[str, ...], _Row]]:
    """Yield the trial's key and the row, for each row."""
    text = read_plain_text(path, _MAX_BYTES, "the table of a benchmark")
    reader = csv.DictReader(io.StringIO(text, newline=""))
    try:
        for record in reader:
            # An empty cell is empty text, unless the value may be unknown.
            values = {k: None if v == "" and k in _MAY_BE_UNKNOWN else v for k, v in record.items()}
            if kind is _TRIAL:
                values.setdefault("participant", participant_by_name(record["planner"]))
            yield tuple(record[name] for name in _KEY), kind.validate_python(values)
    except (csv.Error, KeyError, TypeError, ValueError) as error:
        problem = " ".join(str(error).split()[:20])
        where = f"{path}, line {reader.line_num}"
        raise InputError(f"{where}: {problem}. It was not written by `torc report`.") from None
