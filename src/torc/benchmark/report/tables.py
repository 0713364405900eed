"""The tables of the report, before they become HTML or Markdown."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from torc.benchmark.comparison import ALPHA, compare, holm
from torc.benchmark.measures import COST, DECISION_S, DROP_FREE, MEASURES, SUCCESS
from torc.benchmark.report.cells import TextTable, seconds_text, signed_text, trial_cell
from torc.benchmark.report.ranking import Standing
from torc.benchmark.rows import Table, TrialRow
from torc.problems.sets import set_of

CATEGORIES = ("structured", "unstructured")
_PROMISE_BINS = (0.0, 0.5, 0.8, 0.95, 0.98, 1.0)
_STANDING = (
    "planner",
    "picks to retrieval",
    "more than the best",
    "retrieved",
    "with no drop",
    "drops",
    "decision, s",
    "trials",
    "errored",
)


def ranking_table(standings: Sequence[Standing], table: Table, comparable: bool = True) -> TextTable:
    """Return a row per competing planner, best first; without ranks if they are not comparable."""
    ranked = [s for s in standings if not s.reference]
    rows = [
        (f"{place}" if s.completed and comparable else "-", *_standing_cells(s, table))
        for place, s in enumerate(ranked, start=1)
    ]
    note = (
        "Picks to retrieval: mean, a trial that never got the target counting as its whole budget (the paper's primary "
        "objective); more than the best: on the same problems and seeds, a tie where p is .05 or more; drops: mean "
        "(the secondary one); decision: median. Brackets: 95 % intervals over problems."
    )
    return TextTable("Ranking", ("rank", *_STANDING), rows, note)


def references_table(standings: Sequence[Standing], table: Table) -> TextTable:
    """Return a row per planner that does not compete."""
    note = (
        "To compare with, not to use. They know more than planners are told: the simulation (the oracle, a simulated "
        "model, any planner that took hold of it), or, of a person, the view from outside."
    )
    rows = [_standing_cells(s, table) for s in standings if s.reference]
    return TextTable("References, not ranked", _STANDING, rows, note)


def _standing_cells(s: Standing, table: Table) -> tuple[str, ...]:
    done = table.completed(s.planner)
    gap = "" if s.behind is None else signed_text(s.behind.cost, 1)
    if s.behind is not None and s.p is not None:
        gap += f", p {s.behind.p_text(s.p)}"
    return (
        *(s.planner, s.cost.text(1), gap + (" (a tie)" if s.ties else ""), s.success.text()),
        *(DROP_FREE.of(done).text(), s.drops.text(), seconds_text(DECISION_S.of(done))),
        *(f"{s.completed} of {s.planned}", f"{100 * s.errored:.0f} %"),
    )


def measures_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return every measure, structured and unstructured scenes separately."""
    rows = [
        (planner, category or "all", str(len(done)), *(m.of(done).text(m.digits) for m in MEASURES))
        for planner in planners
        for category in (None, *CATEGORIES)
        if (done := table.completed(planner, category))
    ]
    note = "; ".join(f"{m.name}: {m.help}" for m in MEASURES) + ". Brackets: 95 % intervals over problems."
    return TextTable("All measures", ("planner", "scenes", "trials", *(m.name for m in MEASURES)), rows, note)


def comparison_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Compare every pair of planners on the same problems and seeds."""
    pairs = combinations([p for p in planners if table.completed(p)], 2)
    found = [c for c in (compare(table, *pair) for pair in pairs) if c.pairs]
    rows = []
    for c, p in zip(found, holm([c.p_cost for c in found])):
        better = f"{c.second if c.cost.value > 0 else c.first} is better" if p < ALPHA else "cannot be told"
        facts = f"{c.first} - {c.second}", str(c.pairs), signed_text(c.cost, 1), c.p_text(p)
        rows.append((*facts, signed_text(c.success, 2), signed_text(c.drops, 2), better))
    header = ("pair", "trials of both", "picks to retrieval", "p", "retrieved", "drops", "by picks")
    note = (
        "Differences on the same problem and seed with 95 % intervals over problems; p: permutation test over "
        "problems, corrected for the number of pairs (Holm)."
    )
    return TextTable("Planner against planner", header, rows, note)


def causes_tables(table: Table, planners: Sequence[str]) -> list[TextTable]:
    """Count how attempts and trials ended."""
    tables = []
    done = {p: table.completed(p) for p in planners}
    ends = {p: Counter(r.end for r in rows) for p, rows in done.items()}
    attempts = {p: Counter(pick.result for r in rows for pick in r.picked) for p, rows in done.items()}
    for title, counts in (("How trials ended", ends), ("How attempts ended", attempts)):
        names = [name for name, _ in sum(counts.values(), Counter()).most_common()]
        rows = [
            (p, *(f"{c[n]} ({100 * c[n] / c.total():.0f} %)" if c[n] else "" for n in names))
            for p, c in counts.items()
            if c.total()
        ]
        tables.append(TextTable(title, ("planner", *names), rows))
    return tables


def promises_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Compare what the executed grasps promised with what happened."""
    rows = []
    for planner in planners:
        done = table.completed(planner)
        tried = [
            (p.p, p.held, p.delivered) for r in done for p in r.picked if p.grasp_tried and p.p is not None
        ]
        for low, high in pairwise(_PROMISE_BINS):
            if picks := [pick for pick in tried if low <= pick[0] and (pick[0] < high or high == 1.0)]:
                numbers = (f"{mean:.3f}" for mean in np.mean(picks, axis=0))
                rows.append((planner, f"{low:g} to {high:g}", str(len(picks)), *numbers))
    header = ("planner", "p of the grasp", "carried out", "mean p", "held", "delivered")
    note = "p: the probability that the object is delivered, by the grasp's score and what failed before."
    return TextTable("Grasps: promised and delivered", header, rows, note)


def errors_table(table: Table) -> TextTable:
    """List the errored trials, which are never scored."""
    rows = []
    for r in table.rows:
        if r.status not in ("completed", "missing"):
            said = next((line for line in r.error.splitlines() if line.strip()), "")
            said = said if len(said) <= 200 else f"{said[:197]}..."
            rows.append((r.planner, r.problem, str(r.seed), r.cause, said, trial_cell(table, r)))
    header = ("planner", "problem", "seed", "cause", "what was said", "trial")
    return TextTable("Errored trials, which are not scored", header, rows)


def sets_table(table: Table, planners: Sequence[str], best: str | None) -> TextTable:
    """Return a row per set and planner; none if all are of one set. The others are compared with `best`."""
    rows = []
    sets = {problem: set_of(problem) or "others" for problem in table.problems}
    names = sorted(set(sets.values()))
    for name in names if len(names) > 1 else ():
        part = replace(table, rows=tuple(r for r in table.rows if sets[r.problem] == name))
        for planner in planners:
            if done := part.completed(planner):
                more = "" if best in (None, planner) else signed_text(compare(part, planner, best).cost, 2)
                cost, *shares = (m.of(done).text(m.digits) for m in (COST, SUCCESS, DROP_FREE))
                rows.append((name, planner, str(len(done)), cost, more, *shares))
    against = f"more than {best or 'the best'}"
    header = ("set", "planner", "trials", "picks to retrieval", against, "retrieved", "with no drop")
    note = "More: on the same problems and seeds. Brackets: 95 % intervals over the problems of the set."
    return TextTable("Set by set", header, rows, note)


_HEADER = (
    "planner",
    "trials",
    "calls a trial",
    "calls a pick",
    "tokens sent a trial",
    "tokens written a trial",
    "cost a trial",
    "cost in all",
)
_NOTE = (
    "Means over all trials in which the model was asked, errored ones too; tokens as the server counts them, thinking "
    "included in what is written; cost by the prices that were given with the run. Empty: a reply did not tell its "
    "tokens, or no prices were given. Replies from a cache count as when they were recorded."
)


def vlm_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return a row per planner that asked a model."""
    rows = []
    for planner in planners:
        asked = [row for row in table.of(planner) if row.vlm_calls is not None]
        if asked:
            rows.append((planner, str(len(asked)), *_cells(asked)))
    return TextTable("What the models took", _HEADER, rows, _NOTE)


def _cells(rows: Sequence[TrialRow]) -> tuple[str, ...]:
    calls = [row.vlm_calls or 0 for row in rows]
    picks = sum(row.picks for row in rows if row.completed)
    of_completed = sum(row.vlm_calls or 0 for row in rows if row.completed)
    currencies = {row.currency for row in rows}
    costs = _known([row.vlm_cost for row in rows]) if len(currencies) == 1 else None
    unit = "".join(currencies)
    return (
        f"{sum(calls) / len(rows):.1f}",
        f"{of_completed / picks:.2f}" if picks else "",
        *(_mean(_known([getattr(r, name) for r in rows])) for name in ("tokens_sent", "tokens_written")),
        "" if costs is None else f"{sum(costs) / len(costs):.4g} {unit}",
        "" if costs is None else f"{sum(costs):.4g} {unit}",
    )


def _known(values: Sequence[float | None]) -> list[float] | None:
    """Return the values; None if one is unknown: a sum without it would be too small."""
    found = [v for v in values if v is not None]
    return found if len(found) == len(values) else None


def _mean(values: list[float] | None) -> str:
    return "" if values is None else f"{sum(values) / len(values):,.0f}"
