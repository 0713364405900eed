"""Targets of imported scenes: named by users, or chosen by the paper's rules."""

from dataclasses import replace

import pytest
from settled_scenes import OBJECTS, QUICK, settled

from tests.helpers.graspclutter6d_tree import upright
from torc.errors import InputError
from torc.generation.graspclutter6d.settling import SceneFailure
from torc.generation.graspclutter6d.targets import choose_target, find_target
from torc.generation.surroundings import Surroundings


def test_targets_are_named_by_object_and_instance(tmp_path):
    scene = settled(tmp_path / "tree", OBJECTS)
    assert find_target(scene, "17") == find_target(scene, "17_0") == "obj_000017_0"
    assert find_target(scene, "obj_000044_1") == "obj_000044_1"
    with pytest.raises(InputError, match=r"44 2 times: say which: obj_000044_0, obj_000044_1"):
        find_target(scene, "44")
    with pytest.raises(InputError, match=r"has no object 44_2\. It has: obj_000017_0"):
        find_target(scene, "44_2")


def test_a_target_that_fell_off_is_told(tmp_path):
    beyond = (upright(48, 0.0, 0.80), upright(48, 0.0, -0.80))
    scene = settled(tmp_path / "tree", (*OBJECTS, *beyond), config=replace(QUICK, patience=1))
    failure = find_target(scene, "48_0")
    assert isinstance(failure, SceneFailure)
    assert "fell off" in failure.reason


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


def test_the_least_visible_possible_object_is_chosen(tmp_path):
    scene = settled(tmp_path / "tree", OBJECTS)
    names = [o.name for o in scene.problem.objects]
    view = _View(**dict(zip(names, (0.1, 0.2, 0.3, 0.4))))
    assert choose_target(scene, view, _Inspector()) == names[0]
    assert choose_target(scene, view, _Inspector(impossible=names[:1])) == names[1]
    assert choose_target(scene, view, _Inspector(at_once=names[:2])) == names[2]
    blocked = _Inspector(impossible=[names[3]], around={names[0]: [names[3]], names[1]: [names[2]]})
    assert choose_target(scene, view, blocked) == names[1]
    none = choose_target(scene, view, _Inspector(impossible=names[:3], at_once=names[3:]))
    assert isinstance(none, SceneFailure)
    assert "3 cannot be retrieved, 1 can be picked at once" in none.reason
