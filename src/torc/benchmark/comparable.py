"""Which trials can stand in one table: played under one set of conditions, of one version of a problem, once each."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from torc.benchmark.rows import TrialRow

_LeftOut = list[tuple[TrialRow, str]]


def comparable(rows: Sequence[TrialRow]) -> tuple[tuple[TrialRow, ...], tuple[tuple[Path, str], ...]]:
    """The trials that can be compared, sorted by planner, problem and seed.

    Returns:
        Those; and the directories of the others, each with why it is left out. Of trials that were only planned nothing
        is said.
    """
    left_out: _LeftOut = []
    alike = _of_one_problem(_under_one_condition(rows, left_out), left_out)
    counted = _one_per_cell(alike, left_out)
    return counted, tuple((row.directory, why) for row, why in left_out if _is_played(row))


def _is_played(row: TrialRow) -> bool:
    return row.status != "missing"


def _under_one_condition(rows: Sequence[TrialRow], left_out: _LeftOut) -> Iterator[TrialRow]:
    """Without trials under other conditions than most, or than the first of two that are as common."""
    played = [row for row in rows if _is_played(row)] or rows
    ((most, _),) = Counter(_without_file_names(row.conditions) for row in played).most_common(1)
    told = next(row.conditions for row in played if _without_file_names(row.conditions) == most)
    for row in rows:
        if _without_file_names(row.conditions) == most:
            yield row
        else:
            here, there = (text or "the defaults" for text in (row.conditions, told))
            left_out.append((row, f"it was played with {here}, most others with {there}"))


def _without_file_names(conditions: str) -> str:
    """Of a robot what is in its files counts; its digest says that."""
    return re.sub(r"robot .*? (\([0-9a-f]{8}\))", r"robot \1", conditions)


def _of_one_problem(rows: Iterable[TrialRow], left_out: _LeftOut) -> Iterator[TrialRow]:
    """Without trials of another problem by the same name as that of an earlier row."""
    first: dict[str, TrialRow] = {}
    for row in rows:
        reference = first.setdefault(row.problem, row) if row.digest else row
        if reference.digest == row.digest:
            yield row
        else:
            left_out.append(
                (row, f"its {row.problem} is not the one of {reference.directory}: it has changed")
            )


def _one_per_cell(rows: Iterable[TrialRow], left_out: _LeftOut) -> tuple[TrialRow, ...]:
    cells: dict[tuple[str, str, int], TrialRow] = {}
    for row in sorted(rows, key=_is_played, reverse=True):
        first = cells.setdefault(row.cell, row)
        if first is not row:
            left_out.append((row, f"same planner, problem and seed as {first.directory}"))
    return tuple(cells[key] for key in sorted(cells))
