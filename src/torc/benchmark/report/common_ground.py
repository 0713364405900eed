"""Planners are ranked over the problems that all of them were played on: means over different ones do not compare."""

from dataclasses import dataclass, replace

from torc.benchmark.ranking import Standing, rank
from torc.benchmark.report.verdict import Verdict, verdict
from torc.benchmark.rows import Table


@dataclass(frozen=True)
class Ranking:
    """Planners in order.

    Attributes:
        table: the trials that count in it.
        standings: the planners.
        verdict: the answer.
        comparable: False where some planners share no problem with the others: then the order means nothing.
    """

    table: Table
    standings: list[Standing]
    verdict: Verdict
    comparable: bool = True


def rank_on_common_ground(table: Table) -> Ranking:
    """The ranking over the problems that every planner has trials of; references may have fewer."""
    standings = rank(table)
    ranked = [s.planner for s in standings if not s.reference]
    problems = {planner: {r.problem for r in table.of(planner)} for planner in ranked}
    everything = set().union(*problems.values())
    common = everything.intersection(*problems.values())
    if common == everything:
        return Ranking(table, standings, verdict(table, standings))
    counts = ", ".join(f"{planner} {len(mine)}" for planner, mine in problems.items())
    if not common:
        told = verdict(table, standings)
        answer = f"These planners cannot be ranked: there is no problem that all of them were played on ({counts})."
        return Ranking(table, standings, Verdict(None, answer, (), told.warnings), comparable=False)
    shared = replace(table, rows=tuple(r for r in table.rows if r.problem in common))
    standings = rank(shared)
    told = verdict(shared, standings)
    warning = (
        f"The planners were not played on the same problems ({counts}). Answer and ranking count only the "
        f"{len(common)} that all of them have; what follows counts all."
    )
    return Ranking(shared, standings, replace(told, warnings=(warning, *told.warnings)))
