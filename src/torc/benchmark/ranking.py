"""Which planner is best, by the paper's objectives, and which ones the trials cannot tell from it.

The primary objective is to minimise the picks until the target is retrieved, the secondary one to minimise the objects
dropped (the paper: Task Planning Solutions for TORC). A trial that never retrieves the target has spent its budget and
would need more picks than that: it counts as the whole budget, so that giving up early wins nothing.
"""

from dataclasses import dataclass, replace

from torc.benchmark.comparison import ALPHA, Comparison, compare, holm
from torc.benchmark.intervals import Estimate
from torc.benchmark.measures import COST, DROPS, SUCCESS
from torc.benchmark.rows import Table


@dataclass(frozen=True)
class Standing:
    """A planner in the ranking.

    Attributes:
        cost, success, drops: of its completed trials.
        completed, played, planned: numbers of trials.
        reference: not a planner to use: in some trial it was no participant.
        behind: against the leader; None for the leader itself, and where they share no trial.
        p: of no difference in cost from the leader, corrected for the number of planners; None as `behind`, and for
            references.
    """

    planner: str
    cost: Estimate
    success: Estimate
    drops: Estimate
    completed: int
    played: int
    planned: int
    reference: bool
    behind: Comparison | None = None
    p: float | None = None

    @property
    def ties(self) -> bool:
        """The trials cannot tell it from the leader by the primary objective."""
        return self.p is not None and not self.p < ALPHA

    @property
    def is_leader(self) -> bool:
        """The others are compared with it."""
        return self.behind is None and not self.reference and self.completed > 0

    @property
    def errored(self) -> float:
        """Share of the played trials."""
        return 1 - self.completed / self.played if self.played else 0.0


def rank(table: Table) -> list[Standing]:
    """All planners: by picks to retrieval, then drops; those without a completed trial last, references after all."""
    ordered = sorted((_standing(table, planner) for planner in table.planners), key=_order)
    leader = next((s for s in ordered if not s.reference and s.completed), None)
    if leader is None:
        return ordered
    found = [s if s is leader else _against(table, s, leader) for s in ordered]
    compared = [s for s in found if s.behind is not None and not s.reference]
    corrected = holm([s.behind.p_cost for s in compared if s.behind is not None])
    p_of = {s.planner: p for s, p in zip(compared, corrected)}
    return [replace(s, p=p_of.get(s.planner)) for s in found]


def _standing(table: Table, planner: str) -> Standing:
    rows, done = table.of(planner), table.completed(planner)
    played = sum(r.status != "missing" for r in rows)
    facts = COST.of(done), SUCCESS.of(done), DROPS.of(done)
    reference = not all(r.participant for r in rows)
    return Standing(planner, *facts, len(done), played, len(rows), reference)


def _order(standing: Standing) -> tuple[bool, bool, float, float, str]:
    none = standing.completed == 0
    cost, drops = (0.0, 0.0) if none else (round(standing.cost.value, 9), standing.drops.value)
    return standing.reference, none, cost, drops, standing.planner


def _against(table: Table, standing: Standing, leader: Standing) -> Standing:
    if not standing.completed:
        return standing
    comparison = compare(table, standing.planner, leader.planner)
    return replace(standing, behind=comparison if comparison.pairs else None)
