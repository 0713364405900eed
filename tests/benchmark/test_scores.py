"""The scores are what their names say, and separate what success does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from torc.benchmark.measures import efficiency, regret, scores, with_drops, within
from torc.benchmark.report.tables import give_ups_table, scores_table, sets_table, within_table
from torc.benchmark.rows import Table

ROOT = Path(__file__).parents[2]
MINE = [[3, 4], [2, 15], [6, 3]]
BEST = [[2, 2], [2, 3], [3, 3]]


def test_the_curve_rises_from_nothing_to_the_share_of_successes(made_up):
    rows = made_up(mine=MINE).completed("mine")
    curve = [within(rows, k) for k in range(16)]
    by_hand = [np.mean([n <= k for seeds in MINE for n in seeds if n < 15] + [False]) for k in range(15)]
    assert [c.value for c in curve[:15]] == pytest.approx(by_hand)
    assert curve[15].value == pytest.approx(5 / 6)
    assert all(c.low <= c.value <= c.high for c in curve)


def test_efficiency_is_the_share_of_the_picks_that_were_needed(made_up):
    table = made_up(mine=MINE, oracle=BEST)
    by_hand = np.mean([2 / 3, 2 / 4, 2 / 2, 0, 3 / 6, 3 / 3])
    assert efficiency(table, "mine").value == pytest.approx(by_hand)
    assert efficiency(table, "oracle").value == 1.0
    assert np.isnan(efficiency(made_up(mine=MINE), "mine").value)


def test_only_trials_that_both_have_and_oracle_solved_count(made_up):
    table = made_up(mine=MINE, oracle=[[2, 2], [15, 15]])
    assert efficiency(table, "mine").count == 2
    assert regret(table, "mine", "oracle").count == 4
    assert regret(table, "mine", "oracle").value == pytest.approx(np.mean([1, 2, 2 - 15, 0]))


def test_drops_cost_what_they_are_said_to(made_up):
    rows = made_up(drops=["mine"], mine=MINE).completed("mine")
    free, dear = with_drops(rows, 0), with_drops(rows, 5)
    assert dear.value - free.value == pytest.approx(5 * np.mean([r.drops for r in rows]))


def test_sets_are_told_apart_where_there_are_several(made_up):
    table = made_up(mine=MINE, best=BEST)
    assert not sets_table(table, ["best", "mine"], "best").rows
    names = dict(zip(table.problems, ("absent-01", "structured-01", "a-pile-of-mine")))
    table = replace(table, rows=tuple(replace(r, problem=names[r.problem]) for r in table.rows))
    found = sets_table(table, ["best", "mine"], "best")
    by_cell = {row[:2]: row[2:] for row in found.rows}
    assert {name for name, _ in by_cell} == {"torc-hard/absent", "torc40", "others"}
    for mine, best, name in zip(MINE, BEST, ("torc-hard/absent", "torc40", "others")):
        trials, cost, more, *_ = by_cell[name, "mine"]
        assert (trials, by_cell[name, "best"][2]) == ("2", "")
        assert cost.startswith(f"{np.mean(mine):.1f} [")
        assert more.startswith(f"{np.mean(mine) - np.mean(best):+.2f} [")


def test_failures_fall_into_two_kinds(made_up):
    rows = made_up(mine=MINE).completed("mine")
    fallen = [replace(r, retrieved=False, end="target lost") if r.picks == 6 else r for r in rows]
    found = scores(Table(Path("x"), tuple(fallen)), "mine")
    kinds = found["target lost"], found["failed otherwise"]
    assert [k.value for k in kinds] == pytest.approx([1 / 6, 1 / 6])
    assert sum(k.value for k in kinds) == pytest.approx(1 - np.mean([r.solved for r in fallen]))
    assert found["picks where retrieved"].value == pytest.approx(np.mean([3, 4, 2, 3]))


def test_where_there_is_no_target_giving_up_is_right_and_searching_on_is_not(made_up):
    (row, *_) = made_up(mine=MINE).completed("mine")
    quick = replace(row, absent=True, retrieved=False, end="gave up", picks=2)
    assert (quick.solved, quick.cost) == (True, 2)
    cleared = replace(quick, end="nothing left to try", picks=9)
    assert (cleared.solved, cleared.cost) == (True, 9)
    endless = replace(quick, end="budget spent", picks=15)
    assert (endless.solved, endless.cost) == (False, 15)
    assert not replace(quick, absent=False).solved
    at_once = replace(quick, picks=0)
    rows = (at_once, replace(at_once, planner="oracle"))
    assert efficiency(Table(Path("x"), rows), "mine").value == 1.0


def test_giving_up_is_counted_where_it_is_right_and_where_it_is_wrong(made_up):
    rows = [replace(r, end="gave up", retrieved=False) for r in made_up(mine=MINE).completed("mine")]
    rows = [replace(r, absent=i < 4) for i, r in enumerate(rows)]
    rows[0] = replace(rows[0], end="budget spent")
    whole = Table(Path("x"), tuple(rows))
    names = ("rightly given up", "wrongly given up", "failed otherwise")
    assert [scores(whole, "mine")[name].value for name in names] == pytest.approx([3 / 4, 1, 3 / 6])
    table = give_ups_table(whole, ["mine"])
    assert table.rows[0][:2] == ("mine", "4")
    assert len(table.rows[0]) == len(table.header)
    assert give_ups_table(made_up(mine=MINE), ["mine"]).rows == []


def test_the_tables_have_what_can_be_told(made_up):
    alone, both = made_up(mine=MINE), made_up(mine=MINE, oracle=BEST)
    assert "pick efficiency" not in scores_table(alone, ["mine"]).header
    table = scores_table(both, ["mine", "oracle"])
    (mine, oracle) = (dict(zip(table.header, row)) for row in table.rows)
    assert mine["pick efficiency"].startswith("0.61")
    assert mine["more picks than oracle"].startswith("+3.00")
    assert oracle["more picks than oracle"] == ""
    curve = within_table(both, ["mine"])
    assert all(len(row) == len(curve.header) for row in (*curve.rows,))
    summary = scores(both, "mine")
    assert summary["within 3"].value == pytest.approx(within(both.completed("mine"), 3).value)
