"""Add trials to the published results, and rewrite the tables on their pages.

torc bench --problems torc40 --planners random --first-seed 10 --repeats 5 --out runs/more
python -m tools.published_results add runs/more results/torc40
python -m tools.published_results page results/torc40       # the tables in results/torc40/README.md
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from torc.benchmark.reading import comparable, read_table
from torc.benchmark.report import tables
from torc.benchmark.report.cells import TextTable
from torc.benchmark.report.ranking import rank
from torc.benchmark.report.tables import give_ups_table, scores_table, sets_table, within_table
from torc.benchmark.report.writing import write_report
from torc.benchmark.rows import TRIALS_FILE, Table, read_rows, write_tables
from torc.benchmark.store import calls, write_calls
from torc.errors import InputError

_NOT_KEPT = ("index.html", "*.parquet", "figures/*.png")
_TABLE = re.compile(r"^\|.*\n(?:\|.*\n)+", re.MULTILINE)
_AGAINST = "more than "


@dataclass(frozen=True)
class Add:
    """Add the trials of a benchmark to published results, or start new ones, and rewrite their report."""

    run: tyro.conf.Positional[Path]
    results: tyro.conf.Positional[Path]

    def __call__(self) -> None:
        """Merge. Raises InputError if trials cannot be compared with those already there."""
        known = read_rows(self.results) if (self.results / TRIALS_FILE).is_file() else []
        new = read_table(self.run)
        moved = [replace(r, directory=self.results / r.directory.relative_to(self.run)) for r in new.rows]
        rows, left_out = comparable([*known, *moved])
        for directory, why in (*new.left_out, *left_out):
            raise InputError(f"{directory}: {why}.")
        self.results.mkdir(parents=True, exist_ok=True)
        write_tables(Table(self.results, rows), self.results)
        write_calls(self.results, [*calls(self.results), *calls(self.run)])
        write_report([self.results], self.results)
        for path in (p for pattern in _NOT_KEPT for p in self.results.glob(pattern)):
            path.unlink()


@dataclass(frozen=True)
class Page:
    """Rewrite the tables in the README.md of published results; columns and pairs stay as they are."""

    results: tyro.conf.Positional[Path]

    def __call__(self) -> None:
        """Rewrite the tables. The text is unchanged: check that it still agrees."""
        path = self.results / "README.md"
        path.write_text(with_tables(path.read_text(), read_table(self.results)))


def with_tables(page: str, table: Table) -> str:
    """Return the page with fresh rows in every table whose columns the report has."""
    planners = [s.planner for s in rank(table)]

    def anew(found: re.Match[str]) -> str:
        lines = found[0].splitlines()
        header, first = _cells(lines[0]), {_cells(line)[0] for line in lines}
        for made in _report_tables(table, planners, header):
            if header[0] in made.header[:1] and set(header) <= set(made.header):
                columns = [made.header.index(name) for name in header]
                kept = [r for r in made.rows if header[0] != "pair" or r[0] in first]
                rows = (" | ".join(str(row[i]) for i in columns) for row in kept)
                return "\n".join([*lines[:2], *(f"| {row} |" for row in rows)]) + "\n"
        return found[0]

    return _TABLE.sub(anew, page)


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def _report_tables(table: Table, planners: list[str], header: list[str]) -> Iterator[TextTable]:
    against = next((name.removeprefix(_AGAINST) for name in header if name.startswith(_AGAINST)), None)
    yield sets_table(table, planners, against)
    for make in (give_ups_table, within_table, scores_table):
        yield make(table, planners)
    yield tables.measures_table(table, planners)
    yield from tables.causes_tables(table, planners)
    yield tables.promises_table(table, planners)
    yield tables.comparison_table(table, planners)  # takes longest


def main() -> None:
    """Run `add` or `page`."""
    command: Add | Page = tyro.cli(
        Annotated[Add, tyro.conf.subcommand("add")] | Annotated[Page, tyro.conf.subcommand("page")]
    )
    command()


if __name__ == "__main__":
    main()
