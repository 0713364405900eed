"""What a planner is shown of a snapshot: what perception reported, and no more."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.grasping.planner import GeometricGraspPlanner
from torc.occlusion.volume import FIXED_REAL_CAMERA, empty_volume, update_volume
from torc.perception.privileged import LabelPerception
from torc.pipeline.look import Pipeline
from torc.records import BACKGROUND, ROBOT, TARGET_ID
from torc.task_planning.relations import find_relations
from torc.testing.synthetic import SyntheticBox, synthetic_observation
from torc.workspace.files import load_workspace

SHAPES = (
    SyntheticBox(1, (0.58, -0.12, 1.15), (0.05, 0.14, 0.20)),
    SyntheticBox(2, (0.62, -0.30, 1.10), (0.05, 0.05, 0.10)),
)
SLIVER = (slice(200, 202), slice(300, 306))
"""Twelve pixels: fewer than perception reports."""


@pytest.fixture
def pipeline(robot):
    workspace = load_workspace()
    return Pipeline(
        LabelPerception(),
        GeometricGraspPlanner(robot.gripper, workspace.support_z_m),
        robot.gripper,
        workspace,
        occlusion=FIXED_REAL_CAMERA,
    )


@pytest.fixture
def observation():
    view = synthetic_observation(SHAPES)
    label = view.label_image.copy()
    label[SLIVER] = TARGET_ID
    label[-5:] = ROBOT
    return replace(view, label_image=label)


def _look(pipeline, observation):
    return pipeline.look(observation, empty_volume(pipeline.workspace.grid), target_description="the box")


def test_a_sliver_of_the_hidden_target_is_not_shown_to_planners(pipeline, observation):
    context = _look(pipeline, observation).context
    assert context.scene.target_id is None
    for label in (context.scene.label_image, context.scene.observation.label_image):
        assert np.all(label[SLIVER] == BACKGROUND)
        assert set(np.unique(label)) == {BACKGROUND, ROBOT, *context.scene.ids}


def test_nor_to_grasp_planners(pipeline, observation):
    shown = []

    class Spy(GeometricGraspPlanner):
        def plan(self, scene, volume, rng):
            shown.append(scene)
            return super().plan(scene, volume, rng)

    spy = Spy(pipeline.robot, pipeline.workspace.support_z_m)
    _look(replace(pipeline, grasp_planner=spy), observation)
    for label in (shown[0].label_image, shown[0].observation.label_image):
        assert np.all(label[SLIVER] == BACKGROUND)


def test_every_other_label_stays(pipeline, observation):
    look = _look(pipeline, observation)
    changed = look.context.scene.label_image != observation.label_image
    assert changed.sum() == changed[SLIVER].sum() == 12
    assert look.context.scene.label_image.dtype == observation.label_image.dtype
    assert look.observation is observation


def test_what_is_computed_stays_the_same(pipeline, observation):
    """Clouds, occlusion and relations are those of the labels that perception was given."""
    look = _look(pipeline, observation)
    given = pipeline.perception.perceive(observation)
    volume = update_volume(empty_volume(pipeline.workspace.grid), given, pipeline.occlusion)
    for name in ("seen", "hidden_by", "surface_label"):
        assert np.array_equal(getattr(look.context.volume, name), getattr(volume, name))
    assert np.array_equal(look.context.scene.background_points, given.background_points)
    for a, b in zip(look.context.scene.objects, given.objects, strict=True):
        assert np.array_equal(a.points, b.points)
    assert find_relations(look.context.scene) == find_relations(given)


def test_a_perception_that_needs_no_labels_is_given_none(pipeline, observation):
    class Own:
        def perceive(self, seen, wanted, before):
            assert (wanted.description, before) == ("the box", None)
            assert seen.label_image is None
            scene = pipeline.perception.perceive(observation)
            return replace(scene, observation=seen)

    look = _look(replace(pipeline, perception=Own()), replace(observation, label_image=None))
    assert look.context.scene.observation.label_image is None
    assert np.all(look.context.scene.label_image[SLIVER] == BACKGROUND)


@pytest.mark.parametrize("min_score", [-0.1, 1.1, float("nan")])
def test_a_least_score_is_a_probability(pipeline, min_score):
    with pytest.raises(InputError, match="from 0 to 1"):
        replace(pipeline, min_score=min_score)


def test_the_least_score_decides_which_grasps_count(pipeline, observation):
    scores = _look(pipeline, observation).context.grasps.scores
    between = float(np.median(scores))
    counts = [
        _look(replace(pipeline, min_score=m), observation).context.report.valid_total.sum()
        for m in (0.0, between)
    ]
    assert counts[0] > counts[1] > 0
