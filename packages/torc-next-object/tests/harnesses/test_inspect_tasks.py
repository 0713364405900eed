"""The tasks of inspect_ai, run by it with recorded replies. Needs scripts/harnesses."""

import json

import pytest

from next_object_helpers.harness_environments import run_in_harness
from next_object_helpers.tiny_next_object import tiny_replies, tiny_rows, write_tiny
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answer, score_answers

ROWS = tiny_rows(24)
REPLIES = tiny_replies(ROWS)


def _scores(rows=ROWS, replies=REPLIES):
    answers = [(row.to_dict(), read_number(replies[row.id], row.numbers)) for row in rows]
    return score_answers(answers).to_dict()


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    home = tmp_path_factory.mktemp("inspect")
    replies = home / "replies.json"
    replies.write_text(json.dumps(REPLIES))
    return home, write_tiny(home / "data", ROWS), replies


def _run(prepared, task, *more):
    home, data, replies = prepared
    arguments = ["-m", "next_object_helpers.run_inspect", task, data, replies, home / "logs", *more]
    return run_in_harness("inspect", [str(a) for a in arguments], home)


@pytest.mark.long
def test_inspect_scores_as_scoring_does_to_the_digit(prepared):
    found = _run(prepared, "torc_next_object/next_object_image")
    wanted = _scores()
    for name in ("regret", "regret_low", "regret_high", "top1", "top1_low", "top1_high", "lost", "invalid"):
        assert found["metrics"][name] == wanted[name], name
    assert found["metrics"]["regret_hidden"] == wanted["by"]["target"]["hidden"]["regret"]
    for row in ROWS:
        number = read_number(REPLIES[row.id], row.numbers)
        one = score_answer(row.to_dict(), number)
        sample = found["samples"][row.id]
        assert (sample["lost"], sample["top1"]) == (one.lost, one.top1)
        assert (sample["regret"] == one.regret) == one.counts
        assert found["answers"][row.id] == (None if number is None else str(number))
    assert found["metadata"]["prompt"] == "next-object-image-1"
    assert sorted(map(len, found["asked"])) == sorted(2 + len(row.references) for row in ROWS)
    assert all(kinds[-1] == "text" for kinds in found["asked"])


@pytest.mark.long
def test_inspect_counts_a_row_once_however_often_it_is_asked(prepared):
    found = _run(prepared, "torc_next_object/next_object_grasps", "3")
    assert found["metrics"]["regret"] == _scores()["regret"]
    assert found["metrics"]["invalid"] == _scores()["invalid"]


@pytest.mark.long
def test_inspect_plays_a_retrieval_with_a_picture_every_turn(tmp_path):
    arguments = [
        "-m",
        "next_object_helpers.run_inspect_retrieval",
        "validation-structured-01",
        tmp_path / "logs",
    ]
    replies = ["Answer: 99", "Answer: 1", "I would rather not.", "Answer: 2"]
    found = run_in_harness("inspect", [*map(str, arguments), *replies], tmp_path)
    asked = found["asked"]
    assert [one["kinds"] for one in asked] == [["image", "text"]] * 4
    assert [one["turns"] for one in asked] == [1, 3, 5, 7]
    assert "4 tries left" in asked[0]["text"]
    for before, one in zip(["no valid choice", "removed", "no valid choice"], asked[1:]):
        assert f"ended as: {before}" in one["text"]
    # What was taken is no choice any more.
    assert "choices are: 1, 2" in asked[1]["text"]
    assert "choices are: 2" in asked[2]["text"]
    assert found["end"] == "budget spent"
    assert found["value"] == {
        "retrieved": 0.0,
        "picks": 4.0,
        "drops": found["value"]["drops"],
        "invalid": 2.0,
    }
    assert found["metrics"]["picks"]["mean"] == 4.0
