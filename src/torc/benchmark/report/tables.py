"""The tables of the report, before they become HTML or Markdown."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from torc.benchmark.intervals import ALPHA, holm
from torc.benchmark.measures import (
    COST,
    DECISION_S,
    DROP_FREE,
    DROP_PRICES,
    INFORMED,
    MEASURES,
    ORACLE,
    SUCCESS,
    compare,
    picks_where_solved,
    scores,
    within,
)
from torc.benchmark.report.cells import TextTable, trial_cell
from torc.benchmark.report.ranking import Standing, better_trials
from torc.benchmark.rows import Table, TrialRow
from torc.problems.sets import set_of

WITHIN = (1, 2, 3, 4, 5, 6, 8, 10, 15)
"""Numbers of picks in the table; the figure has all."""
_PROMISE_BINS = (0.0, 0.5, 0.8, 0.95, 0.98, 1.0)
_MAX_SAID = 200


def _completed(table: Table, planners: Sequence[str]) -> Iterator[tuple[str, list[TrialRow]]]:
    """Yield the planners that have completed trials, with these."""
    yield from ((p, done) for p in planners if (done := table.completed(p)))


def ranking_table(standings: Sequence[Standing], table: Table, comparable: bool = True) -> TextTable:
    """Return a row per competing planner, best first; without ranks if they are not comparable."""
    ranked = [s for s in standings if not s.reference]
    rows = [
        {"rank": f"{place}" if s.completed and comparable else "-"} | _standing(s, table)
        for place, s in enumerate(ranked, start=1)
    ]
    return TextTable.of("Ranking", rows)


def references_table(standings: Sequence[Standing], table: Table) -> TextTable:
    rows = [_standing(s, table) for s in standings if s.reference]
    return TextTable.of("References, not ranked", rows)


def _standing(s: Standing, table: Table) -> dict[str, str]:
    done = table.completed(s.planner)
    gap = "" if s.behind is None else s.behind.cost.text(1, "+")
    if s.behind is not None and s.p is not None:
        gap += f", p {s.behind.p_text(s.p)}"
    return {
        "planner": s.planner,
        "picks to retrieval": s.cost.text(1),
        "more than the best": gap + (" (a tie)" if s.ties else ""),
        "retrieved": s.success.text(),
        "with no drop": DROP_FREE.text(done),
        "drops": s.drops.text(),
        "decision, s": DECISION_S.of(done).short,
        "trials": f"{s.completed} of {s.planned}",
        "errored": f"{100 * s.errored:.0f} %",
    }


def measures_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return every measure, structured and unstructured scenes separately."""
    rows = [
        {"planner": planner, "scenes": category or "all", "trials": str(len(done))}
        | {m.name: m.text(done) for m in MEASURES}
        for planner in planners
        for category in (None, "structured", "unstructured")
        if (done := table.completed(planner, category))
    ]
    return TextTable.of("All measures", rows)


def comparison_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Compare every pair of planners on the same problems and seeds."""
    pairs = combinations([planner for planner, _ in _completed(table, planners)], 2)
    found = [c for c in (compare(table, *pair) for pair in pairs) if c.pairs]
    rows = []
    for c, p in zip(found, holm([c.p_cost for c in found])):
        better = f"{c.second if c.cost.value > 0 else c.first} is better" if p < ALPHA else "cannot be told"
        rows.append(
            {
                "pair": f"{c.first} - {c.second}",
                "trials of both": str(c.pairs),
                "picks to retrieval": c.cost.text(1, "+"),
                "p": c.p_text(p),
                "retrieved": c.success.text(2, "+"),
                "drops": c.drops.text(2, "+"),
                "by picks": better,
            }
        )
    return TextTable.of("Planner against planner", rows)


def causes_tables(table: Table, planners: Sequence[str]) -> list[TextTable]:
    """Count how attempts and trials ended."""

    def counted(title: str, ends: Callable[[TrialRow], list[str]]) -> TextTable:
        counts = {p: Counter(e for r in done for e in ends(r)) for p, done in _completed(table, planners)}
        names = [name for name, _ in sum(counts.values(), Counter()).most_common()]
        rows = [
            {"planner": p, **{n: f"{c[n]} ({100 * c[n] / c.total():.0f} %)" if c[n] else "" for n in names}}
            for p, c in counts.items()
            if c.total()
        ]
        return TextTable.of(title, rows)

    return [
        counted("How trials ended", lambda r: [r.end]),
        counted("How attempts ended", lambda r: [pick.result for pick in r.picked]),
    ]


def promises_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Compare what the executed grasps promised with what happened."""
    rows = []
    for planner, done in _completed(table, planners):
        tried = [
            (p.p, p.held, p.delivered) for r in done for p in r.picked if p.grasp_tried and p.p is not None
        ]
        for low, high in pairwise(_PROMISE_BINS):
            if picks := [pick for pick in tried if low <= pick[0] and (pick[0] < high or high == 1.0)]:
                means = (f"{mean:.3f}" for mean in np.mean(picks, axis=0))
                rows.append(
                    {
                        "planner": planner,
                        "p of the grasp": f"{low:g} to {high:g}",
                        "carried out": str(len(picks)),
                    }
                    | dict(zip(("mean p", "held", "delivered"), means))
                )
    return TextTable.of("Grasps: promised and delivered", rows)


def errors_table(table: Table) -> TextTable:
    rows = []
    for r in table.rows:
        if r.played and not r.completed:
            said = next((line for line in r.error.splitlines() if line.strip()), "")
            rows.append(
                {
                    "planner": r.planner,
                    "problem": r.problem,
                    "seed": str(r.seed),
                    "cause": r.cause,
                    "what was said": said if len(said) <= _MAX_SAID else f"{said[: _MAX_SAID - 3]}...",
                    "trial": trial_cell(table, r),
                }
            )
    return TextTable.of("Errored trials, which are not scored", rows)


def sets_table(table: Table, planners: Sequence[str], best: str | None) -> TextTable:
    """Return a row per set and planner; none if all are of one set. The others are compared with `best`."""
    rows = []
    sets = {problem: set_of(problem) or "others" for problem in table.problems}
    names = sorted(set(sets.values()))
    for name in names if len(names) > 1 else ():
        part = replace(table, rows=tuple(r for r in table.rows if sets[r.problem] == name))
        for planner, done in _completed(part, planners):
            more = "" if best in (None, planner) else compare(part, planner, best).cost.text(2, "+")
            rows.append(
                {"set": name, "planner": planner, "trials": str(len(done)), COST.name: COST.text(done)}
                | {f"more than {best or 'the best'}": more}
                | {m.name: m.text(done) for m in (SUCCESS, DROP_FREE)}
            )
    return TextTable.of("Set by set", rows)


def within_table(table: Table, planners: Sequence[str]) -> TextTable:
    budget = max((r.max_picks for r in table.rows), default=0)
    columns = [k for k in WITHIN if k < budget] + [budget]
    rows = [
        {"planner": planner, "trials": str(len(done))}
        | {f"within {k}": within(done, k).text() for k in columns}
        for planner, done in _completed(table, planners)
    ]
    return TextTable.of("Retrieved within k picks", rows)


def scores_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return efficiency, regret, drops at a price, and failures by kind; bounds only if they were played."""
    bounds = {f"more picks than {b}": b for b in (ORACLE, INFORMED) if table.completed(b)}
    names = [
        *(["pick efficiency"] if ORACLE in bounds.values() else []),
        *bounds,
        *(f"picks + {price} x drops" for price in DROP_PRICES),
        *("picks where retrieved", "target lost", "wrong object", "failed otherwise"),
    ]
    rows = []
    for planner, done in _completed(table, planners):
        found = scores(table, planner)
        cells = {n: found[n].text(2, "+" if n in bounds else "") for n in names}
        cells |= {n: "" for n, bound in bounds.items() if bound == planner}
        rows.append({"planner": planner, "trials": str(len(done)), **cells})
    return TextTable.of("Scores", rows)


def give_ups_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return who gave up rightly where the target is absent, after how many picks, and who gave up wrongly."""
    rows = []
    for planner, done in _completed(table, planners if any(r.absent for r in table.rows) else ()):
        absent, found = [r for r in done if r.absent], scores(table, planner)
        rows.append(
            {
                "planner": planner,
                "trials without": str(len(absent)),
                "rightly given up": found["rightly given up"].text(),
                "picks until then": picks_where_solved(absent).text(),
                "wrongly given up": found["wrongly given up"].text(),
                "trials with": str(len(done) - len(absent)),
            }
        )
    return TextTable.of("Where the target is not there", rows)


def vlm_table(table: Table, planners: Sequence[str]) -> TextTable:
    rows = []
    for planner in planners:
        asked = [row for row in table.of(planner) if row.vlm_calls is not None]
        if not asked:
            continue
        done = [row for row in asked if row.completed]
        picks = sum(row.picks for row in done)
        currencies = {row.currency for row in asked}
        costs = _known(asked, "vlm_cost") if len(currencies) == 1 else []
        unit = "".join(currencies)
        rows.append(
            {
                "planner": planner,
                "trials": str(len(asked)),
                "calls a trial": f"{sum(_known(asked, 'vlm_calls')) / len(asked):.1f}",
                "calls a pick": f"{sum(_known(done, 'vlm_calls')) / picks:.2f}" if picks else "",
                "tokens sent a trial": _mean(_known(asked, "tokens_sent")),
                "tokens written a trial": _mean(_known(asked, "tokens_written")),
                "cost a trial": f"{sum(costs) / len(costs):.4g} {unit}" if costs else "",
                "cost in all": f"{sum(costs):.4g} {unit}" if costs else "",
            }
        )
    return TextTable.of("What the models took", rows)


def _known(rows: Sequence[TrialRow], name: str) -> list[float]:
    """Return a value of every row; none if one is unknown: a sum without it would be too small."""
    found = [value for row in rows if (value := getattr(row, name)) is not None]
    return found if len(found) == len(rows) else []


def _mean(values: Sequence[float]) -> str:
    return f"{sum(values) / len(values):,.0f}" if values else ""


def beaten_table(table: Table) -> TextTable:
    rows = [
        {
            "problem": row.problem,
            "seed": str(row.seed),
            "ORACLE": _cost_text(row),
            "others": ", ".join(f"{other.planner} {_cost_text(other)}" for other in better),
            "ORACLE's own mark": row.bound,
            "trial": trial_cell(table, row),
        }
        for row, better in better_trials(table)
        if better
    ]
    note = "Picks to retrieval, drops in brackets where there are any. None of these problems is proved."
    return TextTable.of(f"Where ORACLE is beaten: {len(rows)} trials", rows, note)


def _cost_text(row: TrialRow) -> str:
    return f"{row.cost} ({row.drops})" if row.drops else str(row.cost)
