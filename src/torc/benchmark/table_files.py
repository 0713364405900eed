"""The table of a benchmark for other programs: CSV, and Parquet where DuckDB is installed."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from torc.benchmark.rows import PickRow, Table, TrialRow

_NESTED = ("directory", "picked")
_KEY = ("planner", "problem", "seed")


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
    for name, records in (("trials", trial_records(table)), ("picks", pick_records(table))):
        if records:
            path = directory / f"{name}.csv"
            _write_csv(path, records)
            written.append(path)
            written += _as_parquet(path)
    return written


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
