"""What is asked about a row."""

import pytest

from next_object_helpers.tiny_next_object import tiny_rows
from torc_next_object.prompting import (
    VARIANTS,
    VERSIONS,
    prompt_digest,
    prompt_name,
    prompt_text,
    sent_pictures,
    version_of,
)
from torc_next_object.replies import read_number
from torc_next_object.schema import row_from

ROWS = [row.to_dict() for row in tiny_rows()]
DIGESTS = {
    "image": {1: "1ae193013274", 2: "2ff22f6f4c2d"},
    "grasps": {1: "3deec22e0162", 2: "7d5fe0b6d7fc"},
    "relations": {1: "055e78bcab91", 2: "d7042a06bc2b"},
}
SECOND = {"questions": 2, "gripper": "The gripper has two fingers.", "target_size": "It is 9 cm long."}


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_changed_prompt_is_a_new_one(variant):
    """Results name the prompt's number: give a changed text the next one."""
    assert {version: prompt_digest(variant, version)[:12] for version in VERSIONS} == DIGESTS[variant]


@pytest.mark.parametrize("variant", VARIANTS)
def test_prompts_tell_what_their_variant_has_and_no_more(variant):
    for row in ROWS:
        text = prompt_text(row, variant)
        assert "$" not in text
        assert ("is graspable." in text) == (variant == "grasps")
        assert ('"relation": "behind"' in text) == (variant == "relations")
        assert f"The choices are: {', '.join(map(str, row['numbers']))}." in text
        assert ("not in sight: nothing" in text) == row["target_hidden"]
        assert text.endswith("\n\nAnswer: N")


def test_no_prompt_tells_the_answer():
    """But for the row's own pictures, facts and pairs, rows with other values get the same text."""
    for row in ROWS:
        other = row | {"values": row["values"][::-1], "best": [], "baselines": "{}", "random_value": 1.0}
        other |= {"image": b"", "relations_true": [False], "scene": "", "id": ""}
        assert [prompt_text(row, v) for v in VARIANTS] == [prompt_text(other, v) for v in VARIANTS]


def test_what_a_prompt_asks_for_is_read():
    row = ROWS[0]
    asked = prompt_text(row, "image").splitlines()[-1]
    for number in row["numbers"]:
        assert read_number(asked.replace("N", str(number)), row["numbers"]) == number
    # A model that repeats the question has not answered.
    assert read_number(prompt_text(row, "image"), row["numbers"]) is None


def test_pictures_of_the_target_are_announced():
    for row in ROWS:
        some = sent_pictures(row)
        assert some[0] == row["image"]
        assert len(some) == 1 + len(row["references"])
        assert (len(some) == 2) == ("The second picture" in prompt_text(row, "image"))
    three = ROWS[0] | {"references": [b"a", b"b"]}
    assert "The further pictures" in prompt_text(three, "image")


def test_a_variant_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="grasps"):
        prompt_name("video")


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_second_questions_say_what_the_first_left_open(variant):
    for row in ROWS:
        text = prompt_text(row | SECOND, variant)
        assert "$" not in text
        for said in (*list(SECOND.values())[1:], "A piece of the target may show", "win", "a dotted line"):
            assert said in text
        assert ("in the way of some of its grasps" in text) == (variant == "grasps")
        first = {k: v for k, v in row.items() if k not in SECOND}
        assert prompt_text(first, variant) == prompt_text(row, variant)
        assert prompt_name(variant, version_of(first)) == f"next-object-{variant}-1"
        assert prompt_name(variant, version_of(row | SECOND)) == f"next-object-{variant}-2"


def test_rows_of_older_files_ask_the_first_questions():
    row = {k: v for k, v in ROWS[0].items() if k not in SECOND}
    assert row_from(row) == tiny_rows()[0]
    assert row_from(row).questions == 1
