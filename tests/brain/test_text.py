"""An answer in words: in the frame's labels, and within 80 columns."""

from dataclasses import replace

import pytest

from tests.helpers.fake_episode import ScriptedPlanner
from torc.brain import answer_text, decide_frame


def rows(text: str) -> list[list[str]]:
    """Words of the table's lines, the heading first."""
    return [line.replace(">", " ").split() for line in text.split("\n\n")[1].splitlines()]


def test_the_choice_is_given_by_its_label(frame_of):
    answer = decide_frame(frame_of(), ScriptedPlanner([1]))
    assert answer_text(answer).startswith("Pick object 40000.\nWhy: told to pick 1\n")
    x, y, z = answer.grasps[0].T_world_tcp[:3, 3]
    assert f"Best grasp: at ({x:.3f}, {y:.3f}, {z:.3f}) m" in answer_text(answer)
    assert answer_text(decide_frame(frame_of(), ScriptedPlanner([None]))).startswith("No choice.\n")


def test_every_row_has_its_label(frame_of):
    text = answer_text(decide_frame(frame_of(), ScriptedPlanner([1])))
    heading, *found = rows(text)
    assert heading[0] == "object"
    assert [row[0] for row in found if row[0].isdigit()] == ["7", "512", "40000"]
    assert [row[0] for row in found if "target" in row] == ["512"]
    (marked,) = [line for line in text.splitlines() if line.startswith(" >")]
    assert marked.split()[1] == "40000"


def test_no_choice_tells_what_became_of_each_objects_grasps(frame_of):
    text = answer_text(decide_frame(frame_of(), ScriptedPlanner([None])))
    told = text.partition("What became of the grasps of each object:\n")[2]
    starts = [line.split(":")[0].strip() for line in told.splitlines() if line[2].isdigit()]
    assert starts == ["7", "512", "40000"]
    assert "valid" in told
    assert "Best grasp" not in text


@pytest.mark.parametrize("chosen", [7, None])
def test_lines_fit_eighty_columns(frame_of, chosen):
    frame = replace(frame_of(), names={0: "red mug with a long name", 7: "box"})
    text = answer_text(decide_frame(frame, ScriptedPlanner([chosen])))
    assert "red mug" in text
    assert max(map(len, text.splitlines())) <= 80


def test_a_target_that_shows_too_little_is_said_to_be_hidden(frame_of):
    text = answer_text(decide_frame(frame_of(target=23))).replace("\n", " ")
    assert "The target is object 23, shows too little to be found and counts as hidden." in text
    assert "The target is hidden." in answer_text(decide_frame(frame_of(target="hidden")))
