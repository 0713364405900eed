"""Tables of the scores that distinguish planners, and the meaning of each bound."""

from collections.abc import Sequence

from torc.benchmark.intervals import Estimate
from torc.benchmark.report.cells import TextTable, signed_text
from torc.benchmark.rows import Table
from torc.benchmark.scores import (
    DROP_PRICES,
    INFORMED,
    ORACLE,
    efficiency,
    failed_otherwise,
    false_give_ups,
    lost,
    picks_where_solved,
    regret,
    right_give_ups,
    with_drops,
    within,
    wrong_objects,
)

WITHIN = (1, 2, 3, 4, 5, 6, 8, 10, 15)
"""Numbers of picks in the table; the figure has all."""
BOUNDS = (
    "Which bound is which. ORACLE knows the scene and foresees every draw of chance, unlucky grasps among them: where "
    "its cost is proved, no planner can do with less, but no planner without foresight can be expected to reach it "
    "either. INFORMED knows the scene, and weighs orders of picks by other draws than the trial's: what it needs more "
    "than ORACLE is luck. It is what somebody achieves, no proof: a planner may do better. What a planner needs more "
    "than INFORMED is what seeing and planning better might gain."
)


def within_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return the share of trials solved within k picks."""
    budget = max((r.max_picks for r in table.rows), default=0)
    columns = [k for k in WITHIN if k < budget] + [budget]
    rows = [
        (p, str(len(done)), *(within(done, k).text() for k in columns))
        for p in planners
        if (done := table.completed(p))
    ]
    note = (
        "Share of trials in which the target was retrieved (or, where it is not there, rightly given up) in at most so "
        "many picks, failed ones included. Brackets: 95 % intervals over problems."
    )
    header = ("planner", "trials", *(f"within {k}" for k in columns))
    return TextTable("Retrieved within k picks", header, rows, note)


def scores_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return efficiency, regret, drops at a price, and failures by kind; bounds only if they were played."""
    bounds = [b for b in (ORACLE, INFORMED) if table.completed(b)]
    rows = []
    for p in planners:
        if not (done := table.completed(p)):
            continue
        against = (signed_text(regret(table, p, b), 2) if b != p else "" for b in bounds)
        efficient = (efficiency(table, p).text(),) if ORACLE in bounds else ()
        priced = (with_drops(done, price).text() for price in DROP_PRICES)
        failures = (e.text() for e in (lost(done), wrong_objects(done), failed_otherwise(done)))
        rows.append(
            (p, str(len(done)), *efficient, *against, *priced, picks_where_solved(done).text(), *failures)
        )
    header = (
        *("planner", "trials", *(("pick efficiency",) if ORACLE in bounds else ())),
        *(f"more picks than {b}" for b in bounds),
        *(f"picks + {price} x drops" for price in DROP_PRICES),
        "picks where retrieved",
        "target lost",
        "wrong object",
        "failed otherwise",
    )
    note = (
        "Pick efficiency: ORACLE's picks / one's own on the same problem and seed, 0 where not retrieved; above 1 only "
        "where ORACLE was beaten. More picks: picks to retrieval less the bound's, same problem and seed. Target lost: "
        "it fell, slipped away or was swept off the table; one such accident costs as much as a dozen picks, so that "
        "it is told apart. Brackets: 95 % intervals over problems."
    )
    return TextTable("Scores", header, rows, note)


def give_ups_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Return who gave up rightly where the target is absent, after how many picks, and who gave up wrongly."""
    rows = []
    for p in planners if any(r.absent for r in table.rows) else ():
        if done := table.completed(p):
            absent = [r for r in done if r.absent]
            told = right_give_ups(done).text(), picks_where_solved(absent).text(), false_give_ups(done).text()
            rows.append((p, str(len(absent)), *told, str(len(done) - len(absent))))
    note = (
        "Rightly: the target is not there, and the planner gave up or cleared the table; picks: until then, of those "
        "trials. Wrongly: it is there, and the planner gave up. Brackets: 95 % intervals over problems."
    )
    header = (
        "planner",
        "trials without",
        "rightly given up",
        "picks until then",
        "wrongly given up",
        "trials with",
    )
    return TextTable("Where the target is not there", header, rows, note)


def score_summary(table: Table, planner: str) -> dict[str, Estimate]:
    """Return the scores by name, as data."""
    done = table.completed(planner)
    scores = {
        f"within {k}": within(done, k) for k in range(1, max((r.max_picks for r in done), default=0) + 1)
    }
    scores |= {"pick efficiency": efficiency(table, planner)}
    scores |= {f"more picks than {b}": regret(table, planner, b) for b in (ORACLE, INFORMED)}
    scores |= {f"picks + {price} x drops": with_drops(done, price) for price in DROP_PRICES}
    failures = {"target lost": lost(done), "failed otherwise": failed_otherwise(done)}
    failures |= {"wrong object": wrong_objects(done), "wrongly given up": false_give_ups(done)}
    failures |= {"rightly given up": right_give_ups(done)}
    return scores | {"picks where retrieved": picks_where_solved(done), **failures}
