"""Which trials can stand in one table: played under one set of conditions, of one version of a problem, once each."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from torc.benchmark.rows import TrialRow


def comparable(rows: Sequence[TrialRow]) -> tuple[tuple[TrialRow, ...], tuple[tuple[Path, str], ...]]:
    """The trials that can be compared, sorted by planner, problem and seed.

    Those under the commonest conditions count (the first of two that are as common), of each problem the version of
    the first row, and one trial per planner, problem and seed.

    Returns:
        Those; and the directories of the others, each with why it is left out. Of trials that were only planned nothing
        is said.
    """
    played = [row for row in rows if _is_played(row)] or rows
    ((most, _),) = Counter(map(_conditions, played)).most_common(1)
    told = next(row.conditions for row in played if _conditions(row) == most) or "the defaults"
    problems: dict[str, TrialRow] = {}
    cells: dict[tuple[str, str, int], TrialRow] = {}
    left_out: list[tuple[TrialRow, str]] = []
    alike = []
    for row in rows:
        if _conditions(row) != most:
            here = row.conditions or "the defaults"
            left_out.append((row, f"it was played with {here}, most others with {told}"))
            continue
        first = problems.setdefault(row.problem, row) if row.digest else row
        if first.digest == row.digest:
            alike.append(row)
        else:
            why = f"its {row.problem} is not the one of {first.directory}: it has changed"
            left_out.append((row, why))
    for row in sorted(alike, key=_is_played, reverse=True):
        first = cells.setdefault(row.cell, row)
        if first is not row:
            left_out.append((row, f"same planner, problem and seed as {first.directory}"))
    told_of = tuple((row.directory, why) for row, why in left_out if _is_played(row))
    return tuple(cells[key] for key in sorted(cells)), told_of


def _is_played(row: TrialRow) -> bool:
    return row.status != "missing"


def _conditions(row: TrialRow) -> str:
    """Of a robot what is in its files counts; its digest says that, whatever the file is called."""
    return re.sub(r"robot .*? (\([0-9a-f]{8}\))", r"robot \1", row.conditions)
