"""What a planner is shown of a snapshot: what perception reported, and nothing of the truth beside it."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.geometry.transforms import invert, transform_points
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.occlusion.volume import FIXED_REAL_CAMERA, empty_volume
from torc.perception.checked_scenes import ask_camera
from torc.perception.protocol import Wanted
from torc.perception.segmentation import LabelPerception, PerceptionConfig, segment
from torc.pipeline.failures import FailedGrasp
from torc.pipeline.look import Pipeline
from torc.pipeline.touch import touched_points, with_touched
from torc.records import (
    BACKGROUND,
    EMPTY,
    ROBOT,
    TARGET_ID,
    Capture,
    Observation,
    SegmentedObject,
    SegmentedScene,
    Touch,
    VoxelGrid,
)
from torc.registry.kinds import PerceptionTraits
from torc.robots.kinematics import tcp_pose
from torc.testing.synthetic import SyntheticBox, synthetic_capture
from torc.workspace.workspace_files import load_workspace

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
def capture():
    view = synthetic_capture(SHAPES)
    label = view.label_image.copy()
    label[SLIVER] = TARGET_ID
    label[-5:] = ROBOT
    return replace(view, label_image=label)


def _look(pipeline, seen):
    return pipeline.look(seen, wanted=Wanted("the box"))


def test_a_sliver_of_the_hidden_target_is_not_shown_to_planners(pipeline, capture):
    context = _look(pipeline, capture).context
    assert context.scene.target_id is None
    label = context.scene.label_image
    assert np.all(label[SLIVER] == BACKGROUND)
    assert set(np.unique(label)) == {BACKGROUND, ROBOT, *context.scene.ids}


def test_nor_to_grasp_planners(pipeline, capture):
    shown = []

    class Spy(GeometricGraspPlanner):
        def plan(self, scene, volume, rng):
            shown.append(scene)
            return super().plan(scene, volume, rng)

    spy = Spy(pipeline.robot, pipeline.workspace.support_z_m)
    _look(replace(pipeline, grasp_planner=spy), capture)
    assert np.all(shown[0].label_image[SLIVER] == BACKGROUND)


class Own(PerceptionTraits):
    """Finds the masks that it was made with, and keeps what it is given."""

    def __init__(self, label):
        self.label, self.given = label, []

    def perceive(self, seen, wanted, before, **given):
        self.given.append((seen, wanted.description, before, given))
        return segment(seen, self.label, PerceptionConfig())


class Entitled(Own):
    needs_labels = True


def test_an_observation_holds_no_truth():
    assert "label_image" not in Observation.__dataclass_fields__


def test_a_perception_is_given_the_true_labels_only_if_it_needs_them(pipeline, capture):
    own, entitled = Own(capture.label_image), Entitled(capture.label_image)
    blind, sighted = (_look(replace(pipeline, perception=p), capture) for p in (own, entitled))
    ((seen, *told, given),) = own.given
    assert type(seen) is Observation
    assert told == ["the box", None]
    assert given == {}
    ((seen, *_, given),) = entitled.given
    assert type(seen) is Observation
    assert given.keys() == {"label_image"}
    assert given["label_image"] is capture.label_image
    assert (blind.ids_given, sighted.ids_given) == (False, True)
    assert blind.truth is capture.label_image
    assert sighted.truth is None
    assert np.all(blind.context.scene.label_image[SLIVER] == BACKGROUND)


def records_in(value):
    """A record and all records within it."""
    if is_dataclass(value):
        yield value
        value = [getattr(value, f.name) for f in fields(value)]
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for one in value:
            yield from records_in(one)


def test_nothing_that_planners_are_given_holds_a_capture(pipeline, capture):
    given = []

    class Spy(GeometricGraspPlanner):
        def plan(self, scene, volume, rng):
            given.extend((scene, volume))
            return super().plan(scene, volume, rng)

    spy = Spy(pipeline.robot, pipeline.workspace.support_z_m)
    look = _look(replace(pipeline, grasp_planner=spy), capture)
    assert [type(c) for c in look.captures] == [Capture]
    kinds = {type(r) for one in (*given, look.context) for r in records_in(one)}
    assert {Observation, SegmentedScene} <= kinds
    assert Capture not in kinds
    # Not even as an array: the labels of the snapshot are others than those that are shown.
    truth = capture.label_image
    arrays = [
        getattr(r, f.name) for one in (*given, look.context) for r in records_in(one) for f in fields(r)
    ]
    assert not any(np.array_equal(a, truth) for a in arrays if isinstance(a, np.ndarray))


def test_a_snapshot_without_labels_is_refused_by_a_perception_that_needs_them(pipeline, capture):
    """As of a camera that wraps a simulated one and returns its observation alone."""

    class Wrapper:
        def capture(self):
            return capture.observation

    with pytest.raises(InputError, match="no label image"):
        _look(pipeline, ask_camera(Wrapper()))
    with pytest.raises(InputError, match="no label image"):
        _look(pipeline, capture.observation)
    assert _look(replace(pipeline, perception=Own(capture.label_image)), capture.observation).truth is None


def test_the_least_score_decides_which_grasps_count(pipeline, capture):
    scores = _look(pipeline, capture).context.grasps.scores
    between = float(np.median(scores))
    counts = [
        _look(replace(pipeline, min_score=m), capture).context.report.valid_total.sum()
        for m in (0.0, between)
    ]
    assert counts[0] > counts[1] > 0


@pytest.fixture
def pose(robot):
    return tcp_pose(robot, robot.arm.rest_qpos, robot.gripper.max_width_m)


@pytest.fixture
def touch(robot):
    return Touch(tuple(robot.arm.rest_qpos.tolist()), robot.gripper.max_width_m)


def volume_around(pose, seen_where):
    """One whose voxels are seen, and free, where the function of their centres in the TCP's frame says so."""
    volume = empty_volume(VoxelGrid(pose[:3, 3] - 0.1, 0.01, (20, 20, 20)))
    return replace(volume, seen=seen_where(transform_points(invert(pose), volume.grid.centers())))


@pytest.mark.parametrize("side", [-1, 1])
def test_the_finger_that_nobody_saw_free_has_touched(robot, pose, touch, side):
    points = touched_points(touch, robot, volume_around(pose, lambda p: side * p[..., 0] < 0.02))
    local = transform_points(invert(pose), points)
    assert len(local) > 20
    assert np.all(side * local[:, 0] > 0.02)


def test_points_lie_ahead_by_what_the_arm_went_back(robot, pose, touch):
    volume = volume_around(pose, lambda p: p[..., 0] < 0.02)
    ahead = touched_points(replace(touch, relief_m=0.005), robot, volume)
    assert np.allclose(ahead - touched_points(touch, robot, volume), 0.005 * pose[:3, 2])


def test_nothing_is_felt_where_all_was_seen_free_or_no_contact_was(robot, pose, touch):
    free = volume_around(pose, lambda p: np.ones(p.shape[:-1], dtype=bool))
    assert touched_points(touch, robot, free).shape == (0, 3)
    assert touched_points(None, robot, volume_around(pose, lambda p: p[..., 0] < 0)).shape == (0, 3)
    elsewhere = empty_volume(VoxelGrid(pose[:3, 3] + 5.0, 0.01, (2, 2, 2)))
    assert touched_points(touch, robot, elsewhere).shape == (0, 3)


def test_free_voxels_are_those_seen_without_a_surface(rng):
    volume = empty_volume(VoxelGrid(np.array([0.1, -0.2, 1.0]), 0.01, (5, 6, 7)))
    label = np.where(rng.random(volume.grid.shape) < 0.3, np.int16(2), np.int16(EMPTY))
    volume = replace(volume, seen=rng.random(volume.grid.shape) < 0.6, surface_label=label)
    points = rng.uniform(volume.grid.origin - 0.02, volume.grid.upper + 0.02, (500, 3))
    for point, free in zip(points, volume.free_at(points)):
        i, j, k = np.floor((point - volume.grid.origin) / 0.01).astype(int)
        inside = 0 <= i < 5 and 0 <= j < 6 and 0 <= k < 7
        assert free == (inside and volume.seen[i, j, k] and label[i, j, k] == EMPTY)


def test_felt_points_belong_to_the_object_that_was_tried_and_nothing_seen_changes():
    def thing(k):
        return SegmentedObject(
            k, np.ones((9, 3), np.float32), np.ones((9, 3), np.float32), np.zeros((9, 2), np.int32), 9
        )

    seen = synthetic_capture([SyntheticBox(1, (0.6, 0, 1.1), (0.05, 0.05, 0.05))])
    scene = SegmentedScene(
        seen.observation, seen.label_image, (thing(1), thing(2)), None, np.zeros((0, 3), np.float32)
    )
    failed = FailedGrasp(1, np.eye(4), np.zeros(3), True)
    assert with_touched(scene, (failed,)) is scene
    felt = tuple(replace(failed, touched=np.full((n, 3), n, dtype=float)) for n in (4, 3))
    one, two = with_touched(scene, felt).objects
    assert one.felt[:, 0].tolist() == [4.0] * 4 + [3.0] * 3
    assert one.felt.dtype == np.float32
    assert two.felt.shape == (0, 3)
    assert one.points is scene.objects[0].points
