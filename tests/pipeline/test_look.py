"""What a planner is shown of a snapshot: what perception reported, and no more."""

from dataclasses import replace

import numpy as np
import pytest

from torc.grasping.planner import GeometricGraspPlanner
from torc.occlusion.volume import FIXED_REAL_CAMERA
from torc.perception.privileged import LabelPerception
from torc.pipeline.look import Pipeline
from torc.records import BACKGROUND, ROBOT, TARGET_ID
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
    return pipeline.look(observation, target_description="the box")


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


def test_the_least_score_decides_which_grasps_count(pipeline, observation):
    scores = _look(pipeline, observation).context.grasps.scores
    between = float(np.median(scores))
    counts = [
        _look(replace(pipeline, min_score=m), observation).context.report.valid_total.sum()
        for m in (0.0, between)
    ]
    assert counts[0] > counts[1] > 0
