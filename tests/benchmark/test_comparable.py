"""One table holds trials of one kind, each once, and tells of all others that were played."""

from dataclasses import replace
from pathlib import Path

from torc.benchmark.reading import comparable
from torc.benchmark.rows import TrialRow


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
