"""A problem's difficulty is taken from its file where it states all of it, else measured."""

from dataclasses import replace

from torc.generation.config import Hiddenness
from torc.generation.difficulty import Difficulty, stated_difficulty
from torc.problems.problem import load_problem

PROBLEM = load_problem("structured-04")
STATED = Difficulty(len(PROBLEM.objects), Hiddenness.PARTLY, 0.3125, 7, 8, 9)


def test_what_a_file_states_of_another_target_does_not_count():
    origin = {"target": PROBLEM.target, **STATED.facts()}
    assert stated_difficulty(replace(PROBLEM, origin=origin)) == STATED
    assert stated_difficulty(replace(PROBLEM, origin={**origin, "target": "another"})) is None
