"""Orders come back from where they were kept; a file that holds none is named."""

import json
from dataclasses import replace

import pytest

from torc.errors import InputError
from torc.oracle.answer import ORDER_KEY, ForeseenPick, OracleAnswer, OracleOrder, orders_from, stated_order
from torc.problems.problem import load_problem
from torc.records import TARGET_ID, PickOutcome, PickResult

A, B = load_problem("structured-04"), load_problem("unstructured-03")


def answer_for(problem, ids, proved=True):
    """An answer that picks these objects; the last is the target."""
    names = [placement.name for placement in problem.ordered()]
    results = {True: PickResult.RETRIEVED, False: PickResult.REMOVED}
    foreseen = tuple(
        ForeseenPick(i, names[i], PickOutcome(results[i == TARGET_ID], i, i, True, True), "") for i in ids
    )
    bound = len(ids) if proved else len(ids) - 1
    return OracleAnswer(problem.name, 0, 24.0, True, foreseen, 0, proved, bound, bound, 6, 12)


def _keep(directory, answer, **extra):
    path = directory / f"{answer.problem}-{answer.seed}.json"
    path.write_text(json.dumps({**answer.to_dict(), **extra}))
    return path


def test_answers_come_back_with_their_verdict(tmp_path):
    _keep(tmp_path, answer_for(A, (3, 0)), first_s=1.5, objects=9)
    _keep(tmp_path, answer_for(B, (2, 1, 0), proved=False))
    orders = orders_from(tmp_path, [A, B])
    names = [placement.name for placement in B.ordered()]
    assert orders[B.name].names == (names[2], names[1], names[0])
    assert orders[A.name] == OracleOrder(
        answer_for(A, (3, 0)).order, "2 picks, 0 drops; no order does with less (proved)."
    )
    assert "not proved: every order needs" in orders[B.name].verdict


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("[1, 2]", "not an answer of the oracle"),
        (json.dumps({**answer_for(A, (3, 0)).to_dict(), "problem": "elsewhere"}), "No answer"),
        (json.dumps({**answer_for(B, (3, 0)).to_dict(), "problem": A.name}), "changed since"),
    ],
)
def test_what_is_no_answer_is_named(content, told, tmp_path):
    (tmp_path / "x.json").write_text(content)
    with pytest.raises(InputError, match=told) as caught:
        orders_from(tmp_path, [A])
    assert str(tmp_path) in str(caught.value)


def test_a_problem_may_state_its_order():
    names = tuple(placement.name for placement in A.ordered()[2::-1])
    stated = stated_order(replace(A, origin={ORDER_KEY: ", ".join(names)}))
    assert stated == OracleOrder(names, "3 picks.")
    assert stated_order(replace(A, origin={})) is None
    assert stated_order(replace(A, origin={ORDER_KEY: ""})) is None
    assert stated_order(replace(A, origin={ORDER_KEY: "a thing, another"})) is None
