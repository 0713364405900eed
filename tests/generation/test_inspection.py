"""The first look, for any target of a scene, is the look that the pipeline would take."""

from dataclasses import replace

import numpy as np
import pytest

from torc.generation.config import Hiddenness, hiddenness_of
from torc.generation.inspection import Difficulty, stated_difficulty
from torc.perception.segmentation import PerceptionConfig
from torc.problems.problem import load_problem
from torc.records import TARGET_ID

SCENE = load_problem("structured-04")


@pytest.fixture(scope="module")
def view(inspector):
    return inspector.view(SCENE)


def test_another_target_is_the_same_picture_with_other_numbers(inspector, view):
    other = SCENE.objects[-1].name
    renumbered = view.observation_for(other)
    fresh = inspector.view(replace(SCENE, target=other))
    assert np.array_equal(renumbered.label_image, fresh.observation.label_image)
    assert np.array_equal(renumbered.depth_m, fresh.observation.depth_m)
    for placement in SCENE.objects:
        assert view.fraction(placement.name) == fresh.fraction(placement.name)
        assert view.pixels(placement.name) == fresh.pixels(placement.name)


def test_fractions_are_those_of_the_picture(view):
    labels = view.observation.label_image
    for i, placement in enumerate(SCENE.ordered()):
        assert view.pixels(placement.name) == np.count_nonzero(labels == i)
        assert 0.0 <= view.fraction(placement.name) <= 1.0


def test_graspable_at_first_is_what_the_pipeline_finds_among_all_objects(inspector, view):
    pipeline = replace(inspector.system.pipeline, min_score=0.0)
    answers = []
    for placement in SCENE.objects:
        look = pipeline.look(view.observation_for(placement.name))
        expected = look.context.report.has_valid_grasp(TARGET_ID)
        assert inspector.graspable_at_first(view, placement.name) == expected, placement.name
        answers.append(expected)
    assert len(set(answers)) == 2  # some can be grasped, some cannot


@pytest.mark.parametrize(
    ("fraction", "pixels", "group"),
    [
        (0.9, PerceptionConfig().min_target_pixels - 1, Hiddenness.HIDDEN),
        (0.1, PerceptionConfig().min_target_pixels, Hiddenness.PARTLY),
        (0.7499, 1000, Hiddenness.PARTLY),
        (0.75, 1000, Hiddenness.VISIBLE),
    ],
)
def test_groups_by_what_is_visible(fraction, pixels, group):
    assert hiddenness_of(fraction, pixels) is group


STATED = Difficulty(len(SCENE.objects), Hiddenness.PARTLY, 0.3125, 7, 8, 9)


def test_what_a_file_states_of_another_target_does_not_count():
    origin = {"target": SCENE.target, **STATED.facts()}
    assert stated_difficulty(replace(SCENE, origin=origin)) == STATED
    assert stated_difficulty(replace(SCENE, origin={**origin, "target": "another"})) is None
