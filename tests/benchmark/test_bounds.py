"""ORACLE is a bound only where its trial says so and nobody did with less; the report says which."""

from dataclasses import replace
from pathlib import Path

import pytest

from torc.benchmark.report.bounds import beaten_table, better_trials, bound_summary
from torc.benchmark.report.ranking import rank, verdict
from torc.benchmark.rows import Table

OTHERS = {"mine": [[3, 4], [2, 15], [4, 4]], "theirs": [[5, 5], [3, 3], [2, 6]]}


@pytest.fixture
def table(made_up):
    """p00 proved twice, p01 proved and likely, p02 found, and beaten by both; what it has, and in what it is marked."""
    made = made_up(references=("oracle",), oracle=[[3, 3], [2, 3], [5, 4]], **OTHERS)
    said = {"p00": ("proved", "proved"), "p01": ("proved", "likely"), "p02": ("proved", "found")}
    rows = [replace(r, bound=said[r.problem][r.seed]) if r.planner == "oracle" else r for r in made.rows]
    return Table(Path("x"), tuple(rows))


def _marks(table):
    return list(bound_summary(table)["trials"].items())


def test_a_trial_has_the_mark_that_it_says_unless_another_planner_did_with_less(table):
    better = [[(r.planner, r.cost) for r in found] for _, found in better_trials(table)]
    assert better == [[], [], [], [], [("theirs", 2), ("mine", 4)], []]
    assert _marks(table) == [("proved", 3), ("likely", 1), ("found", 1), ("beaten", 1)]


def test_as_many_picks_with_fewer_drops_are_less_and_errored_trials_are_nothing(table):
    def beaten(planner, **facts):
        rows = [replace(r, **facts) if r.planner == planner and r.problem == "p00" else r for r in table.rows]
        return dict(_marks(Table(Path("x"), tuple(rows))))["beaten"] - 1

    assert beaten("oracle", drops=1) == 1  # mine needs 3 and 4 picks
    assert beaten("mine", picks=1) == 2
    assert beaten("mine", picks=1, status="errored") == 0
    assert beaten("mine", picks=1, retrieved=False) == 0


def test_the_report_says_how_good_the_bound_is_and_lists_where_it_is_none(table):
    found = beaten_table(table)
    assert "1 trials" in found.title
    assert [row[:5] for row in found.rows] == [("p02", "0", "5", "theirs 2, mine 4", "proved")]
    reasons = " ".join(verdict(table, rank(table)).reasons)
    assert "a proved bound in every trial of 1 of 3 problems" in reasons
    assert "of its 6 trials it is proved in 3, likely in 1, found in 1, beaten in 1" in reasons
    assert "Against ORACLE" in reasons
    assert bound_summary(table)["beaten"] == [{"problem": "p02", "seed": 0}]


def test_without_oracle_nothing_is_said_and_without_marks_that_they_are_not_recorded(made_up):
    without = made_up(**OTHERS)
    assert bound_summary(without) is None
    assert "ORACLE" not in " ".join(verdict(without, rank(without)).reasons)
    assert _marks(made_up(oracle=[[2, 2], [2, 2], [2, 2]], **OTHERS)) == [("not recorded", 6)]
