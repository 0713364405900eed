"""What a finger touched counts as felt where nothing was seen."""

from dataclasses import replace

import numpy as np
import pytest

from torc.geometry.transforms import invert, transform_points
from torc.occlusion.volume import empty_volume
from torc.pipeline.failures import FailedGrasp
from torc.pipeline.touch import touched_points, with_touched
from torc.records import EMPTY, SegmentedObject, SegmentedScene, Touch, VoxelGrid
from torc.robots.kinematics import tcp_pose
from torc.testing.synthetic import SyntheticBox, synthetic_observation


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

    observation = synthetic_observation([SyntheticBox(1, (0.6, 0, 1.1), (0.05, 0.05, 0.05))])
    scene = SegmentedScene(
        observation, observation.label_image, (thing(1), thing(2)), None, np.zeros((0, 3), np.float32)
    )
    failed = FailedGrasp(1, np.eye(4), np.zeros(3), True)
    assert with_touched(scene, (failed,)) is scene
    felt = tuple(replace(failed, touched=np.full((n, 3), n, dtype=float)) for n in (4, 3))
    one, two = with_touched(scene, felt).objects
    assert one.felt[:, 0].tolist() == [4.0] * 4 + [3.0] * 3
    assert one.felt.dtype == np.float32
    assert two.felt.shape == (0, 3)
    assert one.points is scene.objects[0].points
