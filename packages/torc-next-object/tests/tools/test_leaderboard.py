"""Which scores the leaderboard takes, and that its page is made from it."""

from copy import deepcopy

import pytest
from leaderboard import PAGE, SPLIT, entry, line, page, read

from next_object_helpers.tiny_next_object import tiny_replies, tiny_rows
from torc.errors import InputError
from torc_next_object.asking.evaluation import RecordedReply
from torc_next_object.asking.standing import FORMAT, standing
from torc_next_object.scoring import score_baselines

ROWS = [row.to_dict() for row in tiny_rows(24)]
BOARD = {
    "baselines": {name: line(scores) for name, scores in score_baselines(ROWS).items()},
    "models": [],
    "data_sha256": {"image": "cd"},
}


@pytest.fixture
def scores():
    replies = {key: RecordedReply(key, text) for key, text in tiny_replies(tiny_rows(24)).items()}
    told = {"format": FORMAT, "harness": "torc vlm-eval", "model": "openai:some-model", "date": "2026-01-02"}
    told |= {"split": SPLIT, "variant": "image", "prompt": "next-object-image-1", "prompt_sha256": "ab"}
    return told | {"data_sha256": "cd"} | standing(ROWS, replies, None)


def test_a_model_stands_with_its_provenance(scores):
    found = entry(scores, "somebody", BOARD)
    assert found["replies_sha256"] == scores["replies_sha256"]
    assert found["regret"] == scores["scores"]["regret"]
    text = page(BOARD | {"models": [found]})
    assert "**openai:some-model**, 2026-01-02, by somebody | image" in text
    assert "No model has been run" not in text


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"format": "other/1"}, "no scores of the format"),
        ({"split": "train"}, "split 'test'"),
        ({"not_answered": 1}, "must be answered"),
        ({"answered": 3}, "must be answered"),
        ({"model": "simulated:0.9"}, "told the truth"),
        ({"data_sha256": "ef"}, "other data"),
    ],
)
def test_what_may_not_stand_is_refused(scores, change, why):
    with pytest.raises(InputError, match=why):
        entry(deepcopy(scores) | change, "somebody", BOARD)


def test_without_a_model_the_page_says_so_and_baselines_are_in_order():
    text = page(BOARD)
    assert "No model has been run yet" in text
    regrets = [float(part.split("|")[3]) for part in text.splitlines() if part.startswith("| `")]
    assert regrets == sorted(regrets)


def test_the_page_is_made_of_the_file():
    assert PAGE.read_text(encoding="utf-8") == page(read())
