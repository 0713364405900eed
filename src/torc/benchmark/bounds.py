"""Whether ORACLE's costs are a bound: what its trials say of themselves, and what other planners show."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from torc.benchmark.rows import Table, TrialRow
from torc.episode.bound import Bound

ORACLE = "oracle"
BEATEN, UNRECORDED = "beaten", "not recorded"
MARKS = (Bound.PROVED.value, Bound.LIKELY.value, Bound.FOUND.value, UNRECORDED, BEATEN)
"""From the best down."""


@dataclass(frozen=True)
class BoundedTrial:
    """A trial of ORACLE beside those of the others.

    Attributes:
        row: the trial.
        better: trials of the same problem and seed with a lower cost, or the same cost and fewer drops; the best first.
    """

    row: TrialRow
    better: tuple[TrialRow, ...]

    @property
    def mark(self) -> str:
        """One of MARKS. Who is beaten has proved nothing, whatever its trial says."""
        return BEATEN if self.better else self.row.bound or UNRECORDED

    @property
    def bounded(self) -> bool:
        """No planner can do with less, as far as is known for certain."""
        return self.mark == Bound.PROVED


def bounded_trials(table: Table) -> list[BoundedTrial]:
    """Every completed trial of ORACLE."""
    others: dict[tuple[str, int], list[TrialRow]] = {}
    for row in table.rows:
        if row.completed and row.planner != ORACLE:
            others.setdefault((row.problem, row.seed), []).append(row)
    return [
        BoundedTrial(row, _better(row, others.get((row.problem, row.seed), ())))
        for row in table.completed(ORACLE)
    ]


def marks(trials: Sequence[BoundedTrial]) -> dict[str, int]:
    """How many trials have each mark, the best first; only marks that occur."""
    counts = Counter(t.mark for t in trials)
    return {mark: counts[mark] for mark in MARKS if counts[mark]}


def bounded_problems(trials: Sequence[BoundedTrial]) -> tuple[int, int]:
    """Problems all of whose trials are proved, and all problems."""
    problems: dict[str, bool] = {}
    for t in trials:
        problems[t.row.problem] = problems.get(t.row.problem, True) and t.bounded
    return sum(problems.values()), len(problems)


def _better(row: TrialRow, others: Sequence[TrialRow]) -> tuple[TrialRow, ...]:
    def cost(other: TrialRow) -> tuple[int, int]:
        return other.cost, other.drops

    return tuple(sorted((o for o in others if cost(o) < cost(row)), key=cost))
