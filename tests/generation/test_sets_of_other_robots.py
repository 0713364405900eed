"""The problems that are shipped for other robots than the default one."""

import pytest

from torc.generation.generator import inspector_for
from torc.generation.validation import validate_problem
from torc.oracle.answer import stated_order
from torc.problems.problem import load_problem, robot_hint, robot_option
from torc.problems.sets import problem_names
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT

SETS = {"validation-ur5e": "ur5e_2f85", "validation-panda": "panda_hand"}


@pytest.mark.parametrize(("problem_set", "robot"), SETS.items())
def test_they_say_for_which_robot_they_are(problem_set, robot):
    made_for, default = load_robot(robot), load_robot()
    names = problem_names(problem_set)
    assert len(names) == 10
    for name in names:
        problem = load_problem(name)
        assert robot_option(problem) == robot
        assert robot_hint(problem, made_for.name, made_for.source) == ""
        assert f"--robot {robot}" in robot_hint(problem, DEFAULT_ROBOT, default.source)
        order = stated_order(problem)
        assert order is not None
        assert len(order.names) >= 2
    assert sum("unstructured" in name for name in names) == 5


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "robot"), [(name, robot) for s, robot in SETS.items() for name in problem_names(s)]
)
def test_they_hold_up(name, robot):
    report = validate_problem(load_problem(name), inspector_for(robot))
    assert report.valid, [c for c in report.checks if not c.passed]
