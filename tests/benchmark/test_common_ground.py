"""No planner is ranked by other problems than the next one."""

from dataclasses import replace
from pathlib import Path

import pytest

from torc.benchmark.reading import comparable, read_table
from torc.benchmark.report.ranking import rank, rank_on_common_ground, verdict
from torc.benchmark.report.tables import ranking_table, references_table
from torc.benchmark.rows import Table, TrialRow
from torc.records import Decision
from torc.specs.trial import TrialSpec
from torc.trials.trial import run_trial

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


def _row(seed, conditions="", status="completed", digest="one", where="here"):
    row = TrialRow("", Path(f"{where}/{seed}"), "p", "structured", "random", seed, status)
    return replace(row, digest=digest, conditions=conditions)


def test_the_conditions_of_most_trials_that_were_played_count():
    planned = [_row(seed, "noise", "missing") for seed in range(10, 20)]
    rows = [*planned, _row(20, "noise"), _row(0), _row(1)]
    counted, left_out = comparable(rows)
    assert [row.seed for row in counted] == [0, 1]
    assert left_out == ((Path("here/20"), "it was played with noise, most others with the defaults"),)
    assert comparable(planned) == (tuple(planned), ())


def test_a_trial_that_was_played_takes_the_place_of_one_that_was_planned():
    planned, played = _row(0, status="missing"), _row(0, where="there")
    for rows in ([planned, played], [played, planned]):
        assert comparable(rows) == ((played,), ())
    again = _row(0, where="again")
    assert comparable([played, again]) == (
        (played,),
        ((Path("again/0"), f"same planner, problem and seed as {Path('there/0')}"),),
    )


def test_of_one_name_only_the_first_problem_counts():
    counted, left_out = comparable([_row(1), _row(0, digest="two"), _row(2, digest="")])
    assert [row.seed for row in counted] == [1, 2]
    assert left_out == ((Path("here/0"), f"its p is not the one of {Path('here/1')}: it has changed"),)


class Honest:
    """Takes the first object that can be grasped."""

    name = "honest"

    def decide(self, context, rng):
        graspable = context.report.graspable_ids
        return Decision(graspable[0] if graspable else None, "the first")


class Cheat(Honest):
    """The same, but it looks where the target is."""

    name = "cheat"

    def attach(self, simulation):
        self.simulation = simulation

    def decide(self, context, rng):
        share = self.simulation.truth().visibility.pixels_alone[0]
        return Decision(super().decide(context, rng).object_id, f"the target has {share} pixels")


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A directory with a trial of each."""
    root = tmp_path_factory.mktemp("played")
    for planner in (Cheat, Honest):
        spec = TrialSpec.of("structured-04", f"{__name__}:{planner.__name__}", max_picks=1)
        run_trial(spec, root / planner.name, say=lambda text: None)
    return root


@pytest.mark.long
def test_a_cheating_plugin_is_listed_as_a_reference(played):
    table = read_table(played)
    standings = rank(table)
    assert [s.planner for s in standings] == [f"{__name__}:Honest", f"{__name__}:Cheat"]
    # It costs the same, and would stand first by its name.
    assert standings[0].cost.value == standings[1].cost.value
    assert [row[1] for row in ranking_table(standings, table).rows] == [f"{__name__}:Honest"]
    assert [row[0] for row in references_table(standings, table).rows] == [f"{__name__}:Cheat"]
    assert verdict(table, standings).planner == f"{__name__}:Honest"
