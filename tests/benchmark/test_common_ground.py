"""No planner is ranked by other problems than the next one."""

from dataclasses import replace
from pathlib import Path

from torc.benchmark.report.ranking import rank_on_common_ground
from torc.benchmark.report.tables import ranking_table
from torc.benchmark.rows import Table

HARD, EASY = [[12, 13]] * 6, [[2, 3]] * 6


def test_one_set_of_problems_is_ranked_as_it_is(made_up):
    table = made_up(references=("oracle",), mine=HARD, theirs=EASY, oracle=EASY[:2])
    found = rank_on_common_ground(table)
    assert found.table is table
    assert [s.planner for s in found.standings] == ["theirs", "mine", "oracle"]
    assert not any("same problems" in w for w in found.verdict.warnings)


def test_easier_problems_do_not_make_a_better_planner(made_up):
    """Theirs played the hard ones only, and is better there."""
    better = [[n - 2 for n in seeds] for seeds in HARD]
    table = made_up(mine=HARD + EASY, theirs=better)
    found = rank_on_common_ground(table)
    assert [s.planner for s in found.standings] == ["theirs", "mine"]
    assert found.verdict.planner == "theirs"
    assert found.verdict.warnings[0].startswith(
        "The planners were not played on the same problems (mine 12, theirs 6). Answer and ranking count only the 6"
    )
    assert len(found.table.problems) == 6


def test_planners_without_a_common_problem_get_no_rank(made_up):
    table = made_up(mine=HARD, theirs=EASY)
    moved = tuple(replace(r, problem=f"other-{r.problem}") if r.planner == "mine" else r for r in table.rows)
    found = rank_on_common_ground(Table(Path("x"), moved))
    assert found.verdict.planner is None
    assert "cannot be ranked" in found.verdict.answer
    rows = ranking_table(found.standings, found.table, found.comparable).rows
    assert [row[0] for row in rows] == ["-", "-"]
