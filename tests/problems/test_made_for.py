"""A problem that was made for a robot of one's own says so; nothing else does."""

from dataclasses import replace

from torc.problems.made_for import robot_hint, robot_wanted
from torc.problems.problem import load_problem

PROBLEM = load_problem("structured-04")
OWN = replace(PROBLEM, origin={"robot": "my_robot", "robot_source": "a1"})


def test_only_another_robot_is_hinted_at():
    assert robot_wanted(OWN) == "my_robot"
    assert "'my_robot': give its file with --robot" in robot_hint(OWN, "another", "b2")
    assert "'my_robot' before its files were changed" in robot_hint(OWN, "my_robot", "b2")
    assert robot_hint(OWN, "renamed", "a1") == ""


def test_others_are_for_whatever_robot_there_is():
    for problem in (PROBLEM, replace(PROBLEM, origin={"robot": "a word of somebody's own"})):
        assert robot_wanted(problem) == ""
        assert robot_hint(problem, "my_robot", "b2") == ""
