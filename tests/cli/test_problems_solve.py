"""`torc problems solve` as a user meets it."""

import pytest
from torc_command import run_torc

from torc.episode.oracle.answer import ForeseenPick, OracleAnswer
from torc.records import PickOutcome, PickResult


@pytest.fixture
def answer(monkeypatch):
    """What the solver answers, whatever it is asked; the questions are noted."""
    foreseen = (
        ForeseenPick(
            3, "box", PickOutcome(PickResult.REMOVED, 3, 3, True, True, (5,)), "the target is hidden"
        ),
        ForeseenPick(0, "can", PickOutcome(PickResult.RETRIEVED, 0, 0, True, True), ""),
    )
    given = {"asked": []}

    def solve(problem, system, seed, budget, *, say):
        given["asked"].append((problem.name, seed, budget, system.conditions.max_picks))
        say("oracle: at it")
        return OracleAnswer(problem.name, seed, budget, True, foreseen, 1, True, 2, 2, 4, 9)

    monkeypatch.setattr("torc.episode.oracle.solve.solve_problem", solve)
    return given


def test_it_prints_the_order_and_how_good_it_is(answer, capsys):
    code, out, err = run_torc(
        "problems", "solve", "structured-01", "--seed", "3", "--budget", "5", capsys=capsys
    )
    assert code == 0
    assert answer["asked"] == [("structured-01", 3, 5.0, 15)]
    assert "structured-01, seed 3: 2 picks, 1 drop; no order does with less (proved)." in out
    assert "1  box  removed, 1 drop; then the target is hidden" in out
    assert "4 picks tried, 9 looks" in out
    assert "at it" in err
