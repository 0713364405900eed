"""Each family asks for what its name says, and twins differ in nothing that a first look shows."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.generation.clutter import without
from torc.generation.config import GenerationConfig
from torc.generation.families import before, hiders
from torc.generation.generator import GeneratedProblem, generate_problem, is_made_from
from torc.generation.sampling import sort_of
from torc.generation.validation import validate_problem
from torc.objects.library import load_object, object_description
from torc.objects.names import base_name
from torc.parts.scene_families.large import COVERS
from torc.parts.scene_families.look_alikes import with_copies
from torc.problems.problem import parse_problem, problem_text
from torc.sim.settling import settle_problem

pytestmark = pytest.mark.long
SMALL = GenerationConfig("structured", objects=(8, 11))
SEED = 7100001


def _made(family, inspector, config=SMALL, seed=SEED):
    found = generate_problem(replace(config, family=family), seed, inspector)
    assert isinstance(found, GeneratedProblem)
    return found.problem


@pytest.fixture(scope="module")
def twins(inspector):
    """A scene without its target, and with it."""
    return _made("absent", inspector), _made("absent-twin", inspector)


def test_twins_are_one_scene_with_and_without_the_target(twins):
    absent, there = twins
    assert absent.absent
    assert not there.absent
    (target,) = set(there.objects) - set(absent.objects)
    assert target.name == there.target == absent.target
    assert target.model == absent.target_model
    assert absent.description == there.description
    assert absent.name != there.name


def test_the_first_look_is_the_same(twins, inspector):
    absent, there = (inspector.view(problem).capture for problem in twins)
    np.testing.assert_array_equal(absent.observation.depth_m, there.observation.depth_m)
    # Both have the target's number, so that all others have theirs.
    np.testing.assert_array_equal(absent.label_image, there.label_image)


def test_both_can_be_written_read_and_made_again(twins, inspector):
    for problem, family in zip(twins, ("absent", "absent-twin")):
        assert parse_problem(problem_text(problem)) == problem
        assert is_made_from(problem, replace(SMALL, family=family), SEED, inspector.robot)
        assert not is_made_from(problem, SMALL, SEED, inspector.robot)


def test_a_target_that_is_not_there_is_valid_if_it_might_be(twins, inspector):
    report = validate_problem(twins[0], inspector)
    assert report.valid
    assert {check.name for check in report.checks} == {"contact", "rest", "absence"}
    lonely = min(twins[0].objects, key=lambda o: load_object(o.model).size_m[2])
    bare = replace(twins[0], objects=(lonely,), target_model="cereal_box_sky")
    assert inspector.places(inspector.view(bare)) == 0


def test_what_is_before_the_target_is_stuck(inspector):
    problem = _made("ungraspable", inspector, seed=7300000)
    view = inspector.view(problem)
    stuck = [o for o in before(view, problem.target, inspector) if not inspector.graspable_at_all(problem, o)]
    assert stuck
    assert inspector.graspable_at_all(problem, problem.target)
    assert not inspector.graspable_at_first(view, problem.target, 2)
    (check,) = [c for c in validate_problem(problem, inspector).checks if c.name == "surroundings"]
    assert check.passed
    usual = replace(problem, origin={})
    (check,) = [c for c in validate_problem(usual, inspector).checks if c.name == "surroundings"]
    assert not check.passed


def test_copies_lack_the_mark_of_the_target_and_one_at_least_is_in_sight(inspector):
    problem = _made("look-alikes", inspector, seed=7200000)
    target = next(o.model for o in problem.objects if o.name == problem.target)
    base = base_name(target)
    copies = [o.name for o in problem.objects if o.model == base]
    assert len(copies) == 3
    view = inspector.view(problem)
    assert max(view.fraction(name) for name in copies) >= 0.5
    assert problem.description == object_description(target) != object_description(base)


def test_scenes_without_enough_objects_have_no_copies():
    assert with_copies(["mug_red", "die_red"], 3) == ["mug_red", "die_red"]
    assert with_copies(["die_red", "mug_red", "ball_red"], 0) == ["die_red", "mug_red", "ball_red"]
    models = ["spoon_steel", "mug_red", "ball_red", "milk_carton_blue", "die_red", "cereal_box_sky"]
    found = with_copies(models, 2)
    assert len(found) == len(models)
    assert found[:3] == ["mug_red"] * 3


def test_hiders_come_by_how_much_they_hide(twins, inspector):
    view = inspector.view(twins[1])
    names = [o.name for o in view.problem.ordered()]
    counts = view.visibility.hidden_by[0]
    found = hiders(view, twins[1].target)
    assert found
    assert [counts[names.index(n)] for n in found] == sorted(
        (counts[names.index(n)] for n in found), reverse=True
    )
    assert set(found) <= set(hiders(view, twins[1].target, COVERS))


def test_large_problems_are_piles():
    with pytest.raises(InputError, match="piles"):
        GenerationConfig("structured", family="large")


def test_something_falls_without_what_is_before_the_target(inspector):
    problem = _made("fragile", inspector, seed=7800000)
    view = inspector.view(problem)
    highest = {o.name: o.position[2] for o in problem.objects}
    fell = [
        o.name
        for gone in before(view, problem.target, inspector)
        for o in settle_problem(without(problem, (gone,)), inspector.workspace)[0].objects
        if o.position[2] < highest[o.name] - 0.01
    ]
    assert fell


def test_the_target_is_hidden_by_its_like(inspector):
    problem = _made("cupboard", inspector, seed=7900000)
    view = inspector.view(problem)
    models = {o.name: o.model for o in problem.objects}
    assert view.pixels(problem.target) == 0
    assert sort_of(models[hiders(view, problem.target)[0]]) == sort_of(models[problem.target]) != ""
    assert len({sort_of(model) for model in models.values()}) >= 2


@pytest.mark.parametrize("family", ["fragile", "cupboard"])
def test_standing_families_have_no_piles(family):
    with pytest.raises(InputError, match="standing objects"):
        GenerationConfig("unstructured", family=family)
