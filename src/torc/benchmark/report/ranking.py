"""Rank planners by the paper's objectives: the best, those that the trials cannot distinguish from it, and the verdict.

The primary objective is to minimise the picks until the target is retrieved, the secondary one to minimise the objects
dropped (the paper: Task Planning Solutions for TORC). A trial that never retrieves the target has spent its budget and
would need more picks than that: it counts as the whole budget, so that giving up early wins nothing.
"""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from torc.benchmark.intervals import ALPHA, Estimate, holm
from torc.benchmark.measures import COST, DECISION_S, DROPS, ORACLE, SUCCESS, Comparison, compare
from torc.benchmark.rows import Table, TrialRow
from torc.episode.bound import Bound
from torc.trials.versions import differing

FEW_PROBLEMS = 10
_BEATEN, _UNRECORDED = "beaten", "not recorded"
_MARKS = (Bound.PROVED.value, Bound.LIKELY.value, Bound.FOUND.value, _UNRECORDED, _BEATEN)
"""Of trials of ORACLE, from the best down."""


@dataclass(frozen=True)
class Standing:
    """A planner in the ranking.

    Attributes:
        cost, success, drops: of its completed trials.
        completed, played, planned: numbers of trials.
        reference: in some trial it was not a participant, so it is not a planner to use.
        behind: compared with the leader; None for the leader itself, and if they share no trial.
        p: probability of this difference in cost from an equal leader, corrected for the number of planners; None like
            `behind`, and for references.
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
        """True if the trials cannot distinguish it from the leader by the primary objective."""
        return self.p is not None and not self.p < ALPHA

    @property
    def errored(self) -> float:
        return 1 - self.completed / self.played if self.played else 0.0

    @property
    def order(self) -> tuple[bool, bool, float, float, str]:
        """Sorts the best first; those without completed trials, and then references, last."""
        none = self.completed == 0
        cost, drops = (0.0, 0.0) if none else (round(self.cost.value, 9), self.drops.value)
        return self.reference, none, cost, drops, self.planner


@dataclass(frozen=True)
class Verdict:
    """The answer of a report: the label of the planner to use, None if none stands out, and the sentences for it."""

    planner: str | None
    answer: str
    reasons: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ranking:
    """Planners in order, and the trials that count. Planners that share no problem are not `comparable`."""

    table: Table
    standings: list[Standing]
    verdict: Verdict
    comparable: bool = True


def rank(table: Table) -> list[Standing]:
    """Return all planners by picks to retrieval, then drops; then those without completed trials, references last."""
    standings = sorted((_standing(table, planner) for planner in table.planners), key=lambda s: s.order)
    leader = _leader(standings)
    if leader is None:
        return standings
    others = [s for s in standings if s is not leader and s.completed]
    compared = {s.planner: compare(table, s.planner, leader.planner) for s in others}
    behind = {planner: found for planner, found in compared.items() if found.pairs}
    competing = [s.planner for s in standings if s.planner in behind and not s.reference]
    p = dict(zip(competing, holm([behind[planner].p_cost for planner in competing])))
    return [replace(s, behind=behind.get(s.planner), p=p.get(s.planner)) for s in standings]


def _standing(table: Table, planner: str) -> Standing:
    rows, done = table.of(planner), table.completed(planner)
    return Standing(
        planner,
        cost=COST.of(done),
        success=SUCCESS.of(done),
        drops=DROPS.of(done),
        completed=len(done),
        played=sum(r.played for r in rows),
        planned=len(rows),
        reference=not all(r.participant for r in rows),
    )


def _leader(standings: Sequence[Standing]) -> Standing | None:
    """Return the planner that the others are compared with."""
    return next((s for s in standings if not s.reference and s.completed), None)


def rank_on_common_ground(table: Table) -> Ranking:
    """Rank over the problems that every planner has trials of: means over different ones do not compare.

    References may have fewer.
    """
    standings = rank(table)
    problems = {s.planner: {r.problem for r in table.of(s.planner)} for s in standings if not s.reference}
    everything = set().union(*problems.values())
    common = everything.intersection(*problems.values())
    if common == everything:
        return Ranking(table, standings, verdict(table, standings))
    counts = ", ".join(f"{planner} {len(mine)}" for planner, mine in problems.items())
    if not common:
        answer = f"These planners cannot be ranked: there is no problem that all of them were played on ({counts})."
        told = Verdict(None, answer, (), tuple(_warnings(table, standings)))
        return Ranking(table, standings, told, comparable=False)
    shared = replace(table, rows=tuple(r for r in table.rows if r.problem in common))
    standings = rank(shared)
    told = verdict(shared, standings)
    warning = (
        f"The planners were not played on the same problems ({counts}). Answer and ranking count only the "
        f"{len(common)} that all of them have; what follows counts all."
    )
    return Ranking(shared, standings, replace(told, warnings=(warning, *told.warnings)))


def verdict(table: Table, standings: Sequence[Standing]) -> Verdict:
    """Decide by the primary objective, and by the secondary one if the first cannot."""
    leader, warnings = _leader(standings), tuple(_warnings(table, standings))
    if leader is None:
        answer = "No planner has completed a trial yet."
        if any(s.completed for s in standings):
            answer = "There are only references here, no planners to use: add some, or the directory of their trials."
        return Verdict(None, answer, (), warnings)
    ties = [s for s in standings if s.ties]
    cleaner = [s for s in ties if s.behind is not None and s.behind.drops.high < 0]
    best = min(cleaner, key=lambda s: s.drops.value) if cleaner else leader
    reasons = [_numbers(table, best), bound_sentence(table, best.planner)]
    if cleaner:
        reasons.append(f"It is chosen for the objects that it does not drop: {leader.planner} drops more.")
    others = [s for s in (leader, *ties) if s is not best]
    if others:
        gaps = (
            f" ({s.behind.cost.text(1, '+')} picks against {leader.planner})" if s.behind else ""
            for s in others
        )
        told = "; ".join(s.planner + gap for s, gap in zip(others, gaps))
        reasons.append(f"By picks it may be no better than: {told}. Trials of more problems would tell.")
        *some, last = [s.planner for s in others]
        names = f"{', '.join(some)} or {last}" if some else last
        answer = f"Use {best.planner}; these trials cannot tell it from {names}."
    elif sum(not s.reference and s.completed > 0 for s in standings) > 1:
        answer = f"Use {best.planner}: it needs fewer picks than every other planner here."
    else:
        answer = f"There is only {best.planner} to judge: add planners to compare it with."
    return Verdict(best.planner, answer, tuple(filter(None, reasons)), warnings)


def _warnings(table: Table, standings: Sequence[Standing]) -> list[str]:
    found = []
    if missing := Counter(r.planner for r in table.rows if not r.played):
        told = ", ".join(f"{planner} {n}" for planner, n in missing.items())
        found.append(
            f"{missing.total()} planned trials have not been played yet ({told}): the same command goes on."
        )
    for s in standings:
        if s.played and not s.completed:
            found.append(f"{s.planner}: all {s.played} played trials errored; it is not ranked.")
        elif s.errored > 0:
            found.append(
                f"{s.planner}: {s.played - s.completed} of {s.played} trials errored and are not scored; if these were "
                "the hard ones, it looks better than it is."
            )
    done = [r for r in table.rows if r.completed]
    problems = len({r.problem for r in done})
    if 0 < problems < FEW_PROBLEMS:
        found.append(
            f"Only {problems} problems: intervals are wide, and another choice of problems may say otherwise."
        )
    budgets, versions = {r.max_picks for r in done}, differing(r.version for r in done)
    if len(budgets) > 1:
        found.append(f"Trials have different budgets of picks ({', '.join(map(str, sorted(budgets)))}).")
    if versions:
        found.append(f"Trials were played with several versions ({', '.join(versions)}).")
    if table.left_out:
        found.append(f"{len(table.left_out)} directories of trials are left out (see the end of this page).")
    return found


def _numbers(table: Table, s: Standing) -> str:
    decision = DECISION_S.of(table.completed(s.planner)).short
    return (
        f"It needs {s.cost.text(1)} picks to retrieve the target, gets it in {100 * s.success.value:.0f} % of the "
        f"trials, drops {s.drops.text()} objects a trial and takes {decision} s "
        f"for a decision ({s.completed} trials of {s.cost.problems} problems)."
    )


def better_trials(table: Table) -> list[tuple[TrialRow, list[TrialRow]]]:
    """Return every completed trial of ORACLE with the trials of others that did with less on that problem and seed.

    Less is a lower cost, or equal cost and fewer drops; the best come first.
    """
    others: dict[tuple[str, int], list[TrialRow]] = defaultdict(list)
    for row in table.rows:
        if row.completed and row.planner != ORACLE:
            others[row.problem, row.seed].append(row)
    return [
        (
            row,
            sorted((o for o in others[row.problem, row.seed] if o.spent < row.spent), key=lambda o: o.spent),
        )
        for row in table.completed(ORACLE)
    ]


def bound_summary(table: Table) -> dict[str, Any] | None:
    """Return plain data: problems, those with only proved trials, marks; None if ORACLE has completed no trial."""
    trials = better_trials(table)
    if not trials:
        return None
    # A beaten trial has proved nothing, whatever it says.
    found = [(row, _BEATEN if better else row.bound or _UNRECORDED) for row, better in trials]
    counts, problems = Counter(mark for _, mark in found), {row.problem for row, _ in found}
    doubtful = {row.problem for row, mark in found if mark != Bound.PROVED.value}
    return {
        "problems": len(problems),
        "problems_proved": len(problems - doubtful),
        "trials": {mark: counts[mark] for mark in _MARKS if counts[mark]},
        _BEATEN: [{"problem": row.problem, "seed": row.seed} for row, better in trials if better],
    }


def bound_sentence(table: Table, planner: str) -> str:
    """Return the planner's gap to ORACLE and what it is worth; "" if ORACLE has completed no trial."""
    found = bound_summary(table)
    if found is None:
        return ""
    gap = ""
    if planner != ORACLE and (pair := compare(table, planner, ORACLE)).pairs:
        gap = f"Against ORACLE, which tries orders out in the simulation first: {pair.cost.text(1, '+')} picks. "
    told = ", ".join(f"{mark} in {count}" for mark, count in found["trials"].items())
    return (
        f"{gap}ORACLE's cost is a proved bound in every trial of {found['problems_proved']} of {found['problems']} "
        f"problems; of its {sum(found['trials'].values())} trials it is {told}."
    )
