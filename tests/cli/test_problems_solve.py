"""`torc problems solve` as a user meets it."""

import json

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
    given = {"solved": True, "asked": []}

    def solve(problem, system, seed, budget, *, say):
        given["asked"].append((problem.name, seed, budget, system.conditions.max_picks))
        say("oracle: at it")
        picks, proved = (foreseen, True) if given["solved"] else ((), False)
        return OracleAnswer(problem.name, seed, budget, given["solved"], picks, 1, proved, 2, 2, 4, 9)

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


def test_json_is_json_and_progress_stays_out_of_it(answer, capsys):
    code, out, _ = run_torc("problems", "solve", "structured-01", "--json", capsys=capsys)
    facts = json.loads(out)
    assert code == 0
    assert (facts["order"], facts["picks"], facts["bound"]) == (["box", "can"], 2, "proved")
    assert facts["foreseen"][0]["outcome"]["dropped"] == [5]


def test_no_order_is_exit_code_one(answer, capsys):
    answer["solved"] = False
    code, out, _ = run_torc("problems", "solve", "structured-01", capsys=capsys)
    assert code == 1
    assert "No order was found; 4 picks tried, 9 looks. A larger budget may find one." in out
