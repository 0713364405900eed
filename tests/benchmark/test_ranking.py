"""The answer follows the paper's objectives, and says where the trials cannot tell."""

from dataclasses import replace
from pathlib import Path

import pytest

from torc.benchmark.measures import COST, MEDIAN_PICKS, compare
from torc.benchmark.paper import METHODS, _per_problem
from torc.benchmark.report.ranking import better_trials, bound_summary, rank, verdict
from torc.benchmark.report.tables import beaten_table, ranking_table, references_table
from torc.benchmark.rows import Table, TrialRow

GOOD = [[3, 4], [2, 3], [4, 4], [3, 2], [5, 4], [2, 2], [3, 3], [4, 5], [3, 3], [2, 4]]
WORSE = [[n + 3 for n in seeds] for seeds in GOOD]
LIKE_GOOD = [[n + (1 if i % 2 else -1) for n in seeds] for i, seeds in enumerate(GOOD)]


def _answer(table):
    return verdict(table, rank(table))


def test_the_planner_with_fewer_picks_wins(made_up):
    found = _answer(made_up(mine=GOOD, theirs=WORSE))
    assert found.planner == "mine"
    assert found.answer == "Use mine: it needs fewer picks than every other planner here."
    assert found.warnings == ()


def test_what_cannot_be_told_apart_is_said(made_up):
    found = _answer(made_up(mine=GOOD, theirs=LIKE_GOOD))
    assert "cannot tell it from" in found.answer


def test_among_ties_the_one_that_drops_fewer_objects_is_chosen(made_up):
    slightly_better = [[n - 1 for n in GOOD[0]], *GOOD[1:]]
    table = made_up(drops=["theirs"], mine=GOOD, theirs=slightly_better)
    assert rank(table)[0].planner == "theirs"
    found = _answer(table)
    assert found.planner == "mine"
    assert "theirs drops more" in " ".join(found.reasons)


def test_giving_up_early_wins_nothing(made_up):
    table = made_up(mine=GOOD, quitter=GOOD)
    rows = tuple(
        replace(r, retrieved=False, picks=1, end="gave up") if r.planner == "quitter" else r
        for r in table.rows
    )
    standings = rank(Table(Path("x"), rows))
    assert [s.planner for s in standings] == ["mine", "quitter"]
    assert standings[1].cost.value == 15.0
    assert MEDIAN_PICKS.of([r for r in rows if r.planner == "quitter"]).value == 1.0


def test_who_does_not_compete_is_neither_ranked_nor_recommended_whatever_its_name(made_up):
    perfect = [[1, 1]] * 10
    table = made_up(references=["cheat"], mine=GOOD, oracle=WORSE, cheat=perfect)
    assert _answer(table).planner == "mine"
    assert [s.planner for s in rank(table)] == ["mine", "oracle", "cheat"]
    ranking = ranking_table(rank(table), table)
    assert [row[:2] for row in ranking.rows] == [("1", "mine"), ("2", "oracle")]
    assert [row[0] for row in references_table(rank(table), table).rows] == ["cheat"]


def test_errored_and_missing_trials_are_not_scored_but_told(made_up):
    table = made_up(mine=GOOD, theirs=WORSE)
    bad = TrialRow("", Path("x/bad"), "p00", "structured", "mine", 7, "errored", "crashed", "SIGSEGV")
    later = replace(bad, seed=8, status="missing", cause="", error="")
    more = Table(Path("x"), (*table.rows, bad, later))
    assert COST.of(more.completed("mine")) == COST.of(table.completed("mine"))
    found = _answer(more)
    assert any("1 of 21 trials errored" in w for w in found.warnings)
    assert any("1 planned trials have not been played" in w for w in found.warnings)
    (standing,) = [s for s in rank(more) if s.planner == "mine"]
    assert (standing.completed, standing.played, standing.planned) == (20, 21, 22)


def test_comparisons_are_paired(made_up):
    # As different from problem to problem as can be, but always one pick apart.
    base = [[i + 1, i + 2] for i in range(11)]
    found = compare(made_up(a=base, b=[[n + 1 for n in s] for s in base]), "b", "a")
    assert (found.cost.value, found.cost.low, found.cost.high) == pytest.approx((1.0, 1.0, 1.0))
    assert found.pairs == 22
    only_first = made_up(a=base, b=[s[:1] for s in base])
    assert compare(only_first, "b", "a").pairs == 11


def test_the_papers_table_adds_up_to_its_figures():
    rows = _per_problem()
    assert len(rows) == 40
    for name, method in METHODS.items():
        mean = sum(float(row[f"{name}_success"]) for row in rows.values()) / len(rows)
        assert mean == pytest.approx(method.success, abs=0.006)


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
