"""What failed counts less, until the object has moved."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logit

from torc.geometry.transforms import make_pose, rotation_about
from torc.pipeline.better_bet import hold_back_unlikely
from torc.pipeline.failures import FailedGrasp, FailureConfig, lower_scores, still_valid, veto
from torc.pipeline.state import stage_rng
from torc.records import (
    GraspReport,
    GraspSet,
    GraspStatus,
    PickOutcome,
    PickResult,
    SegmentedObject,
    SegmentedScene,
)
from torc.testing.synthetic import SyntheticBox, synthetic_capture

CONFIG = FailureConfig()
HERE = np.array([0.6, 0.0, 1.1])


def _grasps():
    down = np.diag([1.0, -1.0, -1.0])
    poses = [
        make_pose(down, HERE),
        make_pose(down @ rotation_about([0, 0, 1], np.pi), HERE),  # the same grasp, fingers swapped
        make_pose(down, HERE + np.array([0.03, 0, 0])),
        make_pose(down @ rotation_about([0, 0, 1], 0.6), HERE),
        make_pose(down, HERE),
    ]
    n = len(poses)
    ids = np.array([1, 1, 1, 1, 2], np.int16)
    generators = np.zeros(n, np.uint8)
    return GraspSet(
        np.stack(poses), np.full(n, 0.05), np.full(n, 0.9), ids, np.zeros((n, 2, 3)), generators, ("a",)
    )


def _failed(executed):
    return FailedGrasp(1, _grasps().Ts_world_tcp[0], HERE, executed)


def test_scores_fall_for_grasps_alike_only():
    once = lower_scores(_grasps(), (_failed(True),), (), CONFIG).scores
    assert np.allclose(once, [0.36, 0.36, 0.9, 0.9, 0.9])
    twice = lower_scores(_grasps(), (_failed(True),) * 2, (), CONFIG).scores
    assert np.allclose(twice[:2], 0.9 * 0.4**2)
    assert np.array_equal(lower_scores(_grasps(), (_failed(False),), (), CONFIG).scores, _grasps().scores)


def test_a_failure_that_was_felt_says_more_than_its_likeness():
    felt = replace(_failed(True), touched=np.zeros((1, 3)))
    assert np.array_equal(lower_scores(_grasps(), (felt,), (), CONFIG).scores, _grasps().scores)


def test_an_object_that_failed_stays_under_suspicion():
    failed = (PickOutcome(PickResult.MISSED, 1), PickOutcome(PickResult.SLIPPED, 1, held_after_lift=True))
    scores = lower_scores(_grasps(), (), failed, CONFIG).scores
    assert np.allclose(logit(scores[:4]), logit(0.9) - 2 * CONFIG.log_odds)
    assert scores[4] == pytest.approx(0.9)
    none_tried = (
        PickOutcome(PickResult.NOT_REACHED, 1),
        PickOutcome(PickResult.NO_PLAN, 1),
        PickOutcome(PickResult.NO_VALID_CHOICE, -1),
        PickOutcome(PickResult.REMOVED, 3, 3, True, True),
    )
    assert np.array_equal(lower_scores(_grasps(), (), none_tried, CONFIG).scores, _grasps().scores)
    without = lower_scores(_grasps(), (), failed, replace(CONFIG, log_odds=0.0)).scores
    assert np.allclose(without, _grasps().scores)


def _report(n=5):
    return GraspReport(
        status=np.zeros(n, np.uint8),
        qpos=np.zeros((n, 7)),
        blockers=np.zeros(n, np.uint64),
        object_ids=(1, 2),
        blocking=np.zeros((2, 2), np.int32),
        blocked_total=np.zeros(2, np.int32),
        valid_total=np.array([4, 1], np.int32),
    )


def test_unlikely_grasps_wait_until_there_are_no_others():
    grasps = replace(_grasps(), scores=np.array([0.9, 0.1, 0.3, 0.2, 0.1]))
    after = hold_back_unlikely(_report(), grasps, 0.25)
    assert after.status.tolist() == [0, GraspStatus.UNLIKELY, 0, GraspStatus.UNLIKELY, GraspStatus.UNLIKELY]
    assert after.valid_total.tolist() == [2, 0]
    assert hold_back_unlikely(_report(), grasps, 0.95).valid_total.tolist() == [4, 1]


def test_grasps_without_a_motion_become_invalid():
    report = _report()
    after = veto(report, _grasps(), (_failed(False),), CONFIG)
    assert after.status.tolist() == [GraspStatus.NO_MOTION] * 2 + [GraspStatus.VALID] * 3
    assert after.valid_total.tolist() == [2, 1]
    assert veto(report, _grasps(), (_failed(True),), CONFIG).valid_total.tolist() == [4, 1]


@pytest.mark.parametrize(("offset", "kept"), [(0.01, 1), (0.02, 0)])
def test_a_moved_object_is_a_new_chance(offset, kept):
    points = (
        np.repeat(HERE[None].astype(np.float32), 9, axis=0)
        + np.float32(offset) * np.eye(3, dtype=np.float32)[0]
    )
    thing = SegmentedObject(1, points, np.zeros_like(points), np.zeros((9, 2), np.int32), 9)
    seen = synthetic_capture([SyntheticBox(1, (0.6, 0, 1.1), (0.05, 0.05, 0.05))])
    scene = SegmentedScene(seen.observation, seen.label_image, (thing,), None, np.zeros((0, 3), np.float32))
    assert len(still_valid((_failed(True),), scene, CONFIG)) == kept
    assert still_valid((replace(_failed(True), object_id=5),), scene, CONFIG) == ()


def _draw(*key):
    return stage_rng(*key).integers(0, 2**60)


def test_same_key_same_stream_other_key_other_stream():
    keys = [(seed, pick, stage) for seed in (0, 1) for pick in (0, 1) for stage in ("grasps", "motion")]
    draws = [_draw(*key) for key in keys]
    assert draws == [_draw(*key) for key in keys]
    assert len(set(draws)) == len(keys)
