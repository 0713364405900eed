"""Targets of imported scenes: named by users, or chosen by the paper's rules; labels, and where problems come from."""

from dataclasses import replace

import pytest
from settled_scenes import OBJECTS, QUICK, settled

from torc.errors import InputError
from torc.generation.graspclutter6d.making import choose_target, find_target, make_problem
from torc.generation.inspection import Surroundings
from torc.problems.problem import parse_problem, problem_text


@pytest.fixture
def scene(tmp_path):
    return settled(tmp_path / "tree", OBJECTS)


def test_targets_are_named_by_object_and_instance(scene):
    assert find_target(scene, "17") == find_target(scene, "17_0") == "obj_000017_0"
    assert find_target(scene, "obj_000044_1") == "obj_000044_1"
    for wanted, told in (
        ("44", r"44 2 times: say which: obj_000044_0, obj_000044_1"),
        ("44_2", r"has no object 44_2\. It has: obj_000017_0"),
    ):
        with pytest.raises(InputError, match=told):
            find_target(scene, wanted)
    with pytest.raises(InputError, match="fell off"):
        find_target(replace(scene, fell=("obj_000017_0",)), "17")


class _Inspector:
    """Says what it is told to."""

    def __init__(self, impossible=(), at_once=(), around=None):
        self.impossible, self.at_once, self.neighbours = impossible, at_once, around or {}

    def graspable_at_all(self, problem, name):
        return name not in self.impossible

    def graspable_at_first(self, view, target):
        return target in self.at_once

    def around(self, problem, target):
        return Surroundings(tuple(self.neighbours.get(target, ())), (), ())


class _View:
    def __init__(self, **fractions):
        self.fractions = fractions

    def fraction(self, name):
        return self.fractions[name]


def test_the_least_visible_possible_object_is_chosen(scene):
    names = [o.name for o in scene.problem.objects]
    view = _View(**dict(zip(names, (0.1, 0.2, 0.3, 0.4))))
    assert choose_target(scene, view, _Inspector()) == names[0]
    assert choose_target(scene, view, _Inspector(impossible=names[:1])) == names[1]
    assert choose_target(scene, view, _Inspector(at_once=names[:2])) == names[2]
    blocked = _Inspector(impossible=[names[3]], around={names[0]: [names[3]], names[1]: [names[2]]})
    assert choose_target(scene, view, blocked) == names[1]
    with pytest.raises(InputError, match="3 cannot be retrieved, 1 can be picked at once"):
        choose_target(scene, view, _Inspector(impossible=names[:3], at_once=names[3:]))


def test_a_problem_says_where_it_comes_from_and_survives_the_disk(scene):
    problem = make_problem(scene, "obj_000044_1", 0.254, QUICK, facts={"target_by": "the paper"})
    assert (problem.name, problem.category) == ("gc6d-249-obj_000044_1", "structured")
    assert (problem.description, problem.target) == ("the can of peaches", "obj_000044_1")
    assert "25% of the target is in sight" in problem.notes
    assert "2 objects like the target" in problem.notes
    assert problem.origin["scene"] == 249
    assert problem.origin["target_by"] == "the paper"
    assert "CC-BY-SA" in problem.origin["licence"]
    assert parse_problem(problem_text(problem)) == problem


def test_the_label_is_the_users_else_the_published_one(scene):
    assert make_problem(replace(scene, number=30), "obj_000017_0", 1.0, QUICK).category == "unstructured"
    by_user = make_problem(scene, "obj_000017_0", 1.0, QUICK, "unstructured")
    assert (by_user.category, by_user.origin["category_by"]) == ("unstructured", "the user")
