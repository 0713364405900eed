"""Statistics of trials, with intervals that respect that trials of one problem are not independent."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Statistic = Callable[[list[dict]], float]
DRAWS = 2000
"""Of a bootstrap."""


@dataclass(frozen=True)
class Bounds:
    """A statistic and its 95 % interval."""

    value: float
    low: float
    high: float


def interval(rows: list[dict], statistic: Statistic, digits: int = 2) -> str:
    """A statistic with its 95 % interval, as text. Empty where there is nothing to count."""
    if np.isnan(statistic(rows)):
        return ""
    found = bounds(rows, statistic)
    return f"{found.value:.{digits}f} [{found.low:.{digits}f}, {found.high:.{digits}f}]"


def bounds(rows: list[dict], statistic: Statistic) -> Bounds:
    """A statistic with its 95 % interval: bootstrap over problems."""
    groups: dict[str, list[dict]] = {}
    for row in rows:
        groups.setdefault(row["problem"], []).append(row)
    names, rng = sorted(groups), np.random.default_rng(0)
    values = []
    for _ in range(DRAWS):
        sample = [row for i in rng.integers(0, len(names), len(names)) for row in groups[names[i]]]
        values.append(statistic(sample))
    low, high = np.nanpercentile(values, [2.5, 97.5])
    return Bounds(statistic(rows), float(low), float(high))


def share(predicate: Callable[[dict], bool]) -> Statistic:
    """Share of the rows for which the predicate holds."""
    return lambda rows: float(np.mean([predicate(row) for row in rows]))


def mean(column: str) -> Statistic:
    """Mean of a column."""
    return lambda rows: float(np.mean([row[column] for row in rows]))


def median(column: str) -> Statistic:
    """Median of a column."""
    return lambda rows: float(np.median([row[column] for row in rows]))


def rate(held: str, executed: str) -> Statistic:
    """Sum of one column over the sum of another; NaN where the latter is 0."""
    return lambda rows: (
        sum(r[held] for r in rows) / n if (n := sum(r[executed] for r in rows)) else float("nan")
    )


def share_of_picks(result: str) -> Statistic:
    """Share of the picks, over all rows together, that ended so."""
    return lambda rows: float(sum(r["outcomes"].count(result) for r in rows) / sum(r["picks"] for r in rows))


RETRIEVED = share(lambda row: row["retrieved"])
WITH_NO_DROP = share(lambda row: row["retrieved"] and row["drops"] == 0)
GRASPS_HELD = rate("grasps_held", "grasps_executed")
LOST = share_of_picks("no valid choice")
UNSEEN_HELD = rate("unseen_held", "unseen_executed")
