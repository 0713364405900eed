"""ORACLE is a bound only where its trial says so and nobody did with less; the report says which."""

from dataclasses import replace
from pathlib import Path

import pytest

from torc.benchmark.ranking import rank
from torc.benchmark.report.bounds import beaten_table, bound_summary, bounded_trials, bounds_table, marks
from torc.benchmark.report.verdict import verdict
from torc.benchmark.rows import Table

OTHERS = {"mine": [[3, 4], [2, 15], [4, 4]], "theirs": [[5, 5], [3, 3], [2, 6]]}


@pytest.fixture
def table(made_up):
    """p00 proved twice, p01 proved and likely, p02 found, and beaten by both; what it has, and in what it is marked."""
    made = made_up(references=("oracle",), oracle=[[3, 3], [2, 3], [5, 4]], **OTHERS)
    said = {"p00": ("proved", "proved"), "p01": ("proved", "likely"), "p02": ("proved", "found")}
    rows = [replace(r, bound=said[r.problem][r.seed]) if r.planner == "oracle" else r for r in made.rows]
    return Table(Path("x"), tuple(rows))


def test_a_trial_has_the_mark_that_it_says_unless_another_planner_did_with_less(table):
    found = bounded_trials(table)
    assert [(t.row.problem, t.row.seed, t.mark) for t in found] == [
        ("p00", 0, "proved"),
        ("p00", 1, "proved"),
        ("p01", 0, "proved"),
        ("p01", 1, "likely"),
        ("p02", 0, "beaten"),
        ("p02", 1, "found"),
    ]
    assert [(r.planner, r.cost) for r in found[4].better] == [("theirs", 2), ("mine", 4)]
    assert marks(found) == {"proved": 3, "likely": 1, "found": 1, "beaten": 1}


def test_as_many_picks_with_fewer_drops_are_less_and_errored_trials_are_nothing(table):
    def changed(planner, **facts):
        rows = [replace(r, **facts) if r.planner == planner and r.problem == "p00" else r for r in table.rows]
        return [t.mark for t in bounded_trials(Table(Path("x"), tuple(rows)))[:2]]

    assert changed("oracle", drops=1) == ["beaten", "proved"]  # mine needs 3 and 4 picks
    assert changed("mine", picks=1) == ["beaten", "beaten"]
    assert changed("mine", picks=1, status="errored") == ["proved", "proved"]
    assert changed("mine", picks=1, retrieved=False) == ["proved", "proved"]


def test_the_report_says_how_good_the_bound_is_and_lists_where_it_is_none(table):
    rows = {row[0]: row[2] for row in bounds_table(table).rows}
    assert rows == {"p00": "proved", "p01": "proved 1, likely 1", "p02": "found 1, beaten 1"}
    beaten = beaten_table(table)
    assert "1 trials" in beaten.title
    assert [row[:5] for row in beaten.rows] == [("p02", "0", "5", "theirs 2, mine 4", "proved")]
    reasons = " ".join(verdict(table, rank(table)).reasons)
    assert "a proved bound in every trial of 1 of 3 problems" in reasons
    assert "of its 6 trials it is proved in 3, likely in 1, found in 1, beaten in 1" in reasons
    assert "Against ORACLE" in reasons
    assert bound_summary(table) == {
        "problems": 3,
        "problems_proved": 1,
        "trials": {"proved": 3, "likely": 1, "found": 1, "beaten": 1},
        "beaten": [{"problem": "p02", "seed": 0}],
    }


def test_without_oracle_nothing_is_said_and_without_marks_that_they_are_not_recorded(made_up):
    without = made_up(**OTHERS)
    assert not (*bounds_table(without).rows, *beaten_table(without).rows)
    assert bound_summary(without) is None
    assert "ORACLE" not in " ".join(verdict(without, rank(without)).reasons)
    old = made_up(oracle=[[2, 2], [2, 2], [2, 2]], **OTHERS)
    assert {row[2] for row in bounds_table(old).rows} == {"not recorded"}
