"""Nobody takes torc's numbers for the frame's labels."""

from dataclasses import replace

import numpy as np

from torc.brain import answer_text, decide_frame
from torc.testing.fake_episode import ScriptedPlanner


def rows(text: str) -> list[list[str]]:
    """Words of the table's lines, the heading first."""
    return [line.replace(">", " ").split() for line in text.split("\n\n")[1].splitlines()]


def test_the_choice_is_given_by_its_label_and_the_number_beside_it(frame_of):
    text = answer_text(decide_frame(frame_of(), ScriptedPlanner([1])))
    assert text.startswith("Pick label 40000, which is number 1 in what follows.\nWhy: told to pick 1\n")
    assert answer_text(decide_frame(frame_of(), ScriptedPlanner([7]))).startswith("Pick label 7.\n")
    assert answer_text(decide_frame(frame_of(), ScriptedPlanner([None]))).startswith("No choice.\n")


def test_every_number_stands_beside_its_label(frame_of):
    text = answer_text(decide_frame(frame_of(), ScriptedPlanner([1])))
    heading, *found = rows(text)
    assert heading[:2] == ["number", "label"]
    assert {(row[0], row[1]) for row in found} == {("0", "512"), ("1", "40000"), ("7", "7")}
    assert [row[-1] for row in found if row[0] == "0"] == ["target"]
    (marked,) = [line for line in text.splitlines() if line.startswith(" >")]
    assert marked.split()[1] == "1"


def test_labels_are_left_away_where_they_are_the_numbers(frame_of):
    frame = frame_of()
    same = replace(frame, labels={k: k for k in frame.labels})
    text = answer_text(decide_frame(same, ScriptedPlanner([1])))
    assert text.startswith("Pick object 1.\n")
    assert "label 23" in text
    assert rows(text)[0][0] == "object"
    assert "label: yours" not in text


def test_names_and_probabilities_are_shown_if_there_are_any(frame_of):
    frame = replace(frame_of(), names={0: "red mug"})
    text = answer_text(decide_frame(frame))
    assert "red mug" in text
    assert " p " in text
    assert " p " not in answer_text(decide_frame(frame, ScriptedPlanner([1])))


def test_what_is_left_out_is_said(frame_of):
    assert "Left out, for too few pixels or readings of depth: label 23." in answer_text(
        decide_frame(frame_of())
    )


def test_a_target_that_shows_too_little_is_said_to_be_hidden(frame_of):
    text = answer_text(decide_frame(frame_of(target=23)))
    assert "The target is label 23, shows too little to be found and counts as hidden." in text
    assert "The target is hidden." in answer_text(decide_frame(frame_of(target="hidden")))


def test_a_frame_without_anything_to_see_has_no_table(frame_of):
    frame = frame_of()
    label = np.where(frame.observation.label_image == 23, np.int16(23), np.int16(-1))
    nothing = replace(frame, observation=replace(frame.observation, label_image=label))
    text = answer_text(decide_frame(nothing))
    assert text.startswith("No choice.")
    assert "Objects in sight: 0." in text
    assert "blocked by" not in text
