"""The shipped sets of harder problems are what their rules say."""

import pytest

from tools.hard_sets import RULES
from torc.generation.generator import inspector_for
from torc.generation.validation import validate_problem
from torc.oracle.answer import stated_order
from torc.problems.problem import load_problem
from torc.problems.sets import problem_names, problem_sets, select_problems
from torc.specs.conditions import Conditions

GROUP = "torc-hard"
SETS = tuple(name for name in problem_sets() if name.startswith(f"{GROUP}/"))


def test_the_group_is_all_of_its_sets():
    assert f"{GROUP}/absent" in SETS
    assert sorted(select_problems(GROUP)) == sorted(name for s in SETS for name in problem_names(s))


@pytest.mark.parametrize("problem_set", SETS)
def test_picks_of_oracle_are_within_the_rule_and_seeds_differ(problem_set):
    rule = RULES[problem_set.removeprefix(f"{GROUP}/")]
    problems = [load_problem(name) for name in problem_names(problem_set)]
    assert len(problems) <= sum(rule.each.values()) * (2 if rule.twins else 1)
    for problem in problems:
        order = stated_order(problem)
        assert order is not None
        # To give up is the last entry of an order, and no pick.
        picks = int(problem.origin["oracle_picks"])
        assert len(order.names) == picks
        assert (2 if problem.name.endswith("-twin") else rule.fewest) <= picks <= rule.most
    seeds = [(p.category, p.origin["seed"], p.absent) for p in problems]
    assert len(set(seeds)) == len(seeds)


def test_each_absent_problem_has_its_twin():
    names = problem_names(f"{GROUP}/absent")
    pairs = list(zip(names[::2], names[1::2]))
    assert len(pairs) == 10
    for name, twin in pairs:
        gone, there = load_problem(name), load_problem(twin)
        assert twin == f"{name}-twin"
        assert gone.absent
        assert set(there.objects) - set(gone.objects) == {o for o in there.objects if o.name == there.target}
        assert gone.description == there.description


@pytest.mark.long
@pytest.mark.parametrize("name", [problem_names(s)[0] for s in SETS])
def test_one_of_each_set_holds_up(name):
    problem = load_problem(name)
    inspector = inspector_for(workspace=Conditions().at(problem.workspace).workspace)
    report = validate_problem(problem, inspector)
    assert report.valid, [c for c in report.checks if not c.passed]
