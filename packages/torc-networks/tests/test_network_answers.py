"""What a server answers is what it must be, or an error: nothing half right goes on."""

import numpy as np
import pytest

from torc.errors import NetworkError
from torc.geometry.transforms import make_pose, rotation_about
from torc_networks.fields import Fields, Motion, read_disparity, read_grasps, read_masks, read_motion

R = rotation_about([1.0, 2.0, 3.0], 0.7)
T = make_pose(R, [0.1, 0.2, 0.3])
NAN = float("nan")
YES = np.ones((2, 3, 4), bool)


def _answer(**fields):
    return Fields(fields, lambda why: NetworkError("tcp://127.0.0.1:1", "test", why, "Mend it."))


def test_masks_are_read_as_masks_and_as_labels():
    labels = np.array([[0, 0, -1], [1, -5, 1]], np.int16)
    as_labels = read_masks(_answer(labels=labels, scores=[0.9, 0.8]))
    stacked = np.stack([labels == 0, labels == 1])
    for masks in (stacked, stacked.astype(np.int64)):
        as_masks = read_masks(_answer(masks=masks, scores=np.array([0.9, 0.8])))
        np.testing.assert_array_equal(as_masks.masks, as_labels.masks)
    np.testing.assert_array_equal(as_labels.masks, stacked)
    assert as_labels.scores.dtype == np.float32


def test_no_masks_are_none():
    assert len(read_masks(_answer(masks=np.zeros((0, 3, 4), bool), scores=[])).masks) == 0
    found = read_masks(_answer(labels=np.full((3, 4), -1), scores=np.zeros(0)))
    assert found.masks.shape == (0, 3, 4)


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"masks": YES},
        {"masks": YES, "scores": [0.5]},
        {"masks": YES, "scores": [0.5, NAN]},
        {"masks": YES, "scores": [0.5, np.inf]},
        {"masks": YES, "scores": [0.5, 7.0]},
        {"masks": YES, "scores": [0.5, -0.5]},
        {"masks": YES, "scores": "ab"},
        {"masks": YES[0], "scores": [0.5, 0.5]},
        {"masks": YES * 2, "scores": [0.5, 0.5]},
        {"masks": YES.astype(float), "scores": [0.5, 0.5]},
        {"masks": YES, "labels": YES[0].astype(int), "scores": [0.5, 0.5]},
        {"labels": np.full((3, 4), 2), "scores": [0.5, 0.5]},
        {"labels": np.zeros((3, 4)), "scores": [0.5]},
        {"labels": np.full((3, 4), 2**63, np.uint64), "scores": [0.5]},
        {"labels": np.zeros((1, 1), int), "scores": np.zeros(5000)},
    ],
    ids=str,
)
def test_masks_that_are_none_are_refused(fields):
    with pytest.raises(NetworkError, match="'test'"):
        read_masks(_answer(**fields))


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"disparity": np.zeros((2, 3), int)},
        {"disparity": np.zeros((1, 2, 3))},
        {"disparity": np.zeros((0, 3))},
        {"disparity": np.zeros((2, 3)), "confidence": np.zeros((2, 2))},
        {"disparity": "none"},
    ],
    ids=str,
)
def test_a_disparity_that_is_none_is_refused(fields):
    with pytest.raises(NetworkError):
        read_disparity(_answer(**fields))


def test_grasps_are_read():
    found = read_grasps(_answer(grasps=np.stack([T, T]).astype("f4"), confidences=[0.25, 1.0000001]))
    np.testing.assert_allclose(found.Ts, [T, T], atol=1e-6)
    assert found.confidences.tolist() == [0.25, 1.0]
    assert np.isnan(found.widths_m).all()
    told = {"grasps": T[None], "confidences": [0.5], "widths": np.array([0.04]), "object_ids": np.array([3])}
    assert read_grasps(_answer(**told), of_scene=True).object_ids.tolist() == [3]


@pytest.mark.parametrize("none", [np.zeros((0, 4, 4)), np.zeros(0), []])
def test_no_grasps_are_none(none):
    assert len(read_grasps(_answer(grasps=none, confidences=[])).Ts) == 0
    assert len(read_grasps(_answer(grasps=none), of_scene=True).object_ids) == 0


def test_rotations_of_half_precision_are_made_exact():
    rough = T.astype("f2").astype(float)
    found = read_grasps(_answer(grasps=rough[None], confidences=[0.5])).Ts[0]
    assert np.abs(found[:3, :3] @ found[:3, :3].T - np.eye(3)).max() < 1e-12
    np.testing.assert_allclose(found, T, atol=2e-3)


def _with(Ts, value, *index):
    out = np.array(Ts)
    out[index] = value
    return out


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"grasps": T, "confidences": [0.5]},
        {"grasps": T[None], "confidences": [0.5, 0.5]},
        {"grasps": T[None], "confidences": [NAN]},
        {"grasps": T[None]},
        {"grasps": _with(T[None], NAN, 0, 0, 3), "confidences": [0.5]},
        {"grasps": _with(T[None], np.inf, 0, 1, 1), "confidences": [0.5]},
        {"grasps": T[None] * np.array([1, -1, 1, 1]), "confidences": [0.5]},
        {"grasps": T[None] * np.array([2, 2, 2, 1]), "confidences": [0.5]},
        {"grasps": T.T[None], "confidences": [0.5]},
        {"grasps": T[None] * 1e200, "confidences": [0.5]},
        {"grasps": _with(T[None], 1e6, 0, 0, 3), "confidences": [0.5]},
        {"grasps": [[1], [2, 3]], "confidences": [0.5]},
        {"grasps": np.zeros((1, 4, 4)), "confidences": [0.5]},
        {"grasps": T[None, :3], "confidences": [0.5]},
        {"grasps": T[None], "confidences": [0.5], "widths": np.array([-0.01])},
        {"grasps": T[None], "confidences": [0.5], "widths": np.array([np.inf])},
        {"grasps": T[None], "confidences": [0.5], "widths": np.array([[0.01]])},
    ],
    ids=str,
)
def test_grasps_that_are_none_are_refused(fields):
    with pytest.raises(NetworkError):
        read_grasps(_answer(**fields))


@pytest.mark.parametrize("ids", [None, np.array([0.5]), np.array([1, 2])])
def test_grasps_of_a_scene_must_tell_whose_they_are(ids):
    with pytest.raises(NetworkError):
        read_grasps(_answer(grasps=T[None], confidences=[0.5], object_ids=ids), of_scene=True)


def test_a_motion_and_a_failure_are_read():
    found = read_motion(_answer(times=[0.0, 0.1], positions=np.zeros((2, 7), "f4")), 7)
    assert isinstance(found, Motion)
    assert read_motion(_answer(failure="no way", times=[1]), 7) == "no way"


@pytest.mark.parametrize(
    ("times", "positions"),
    [
        ([0.0], np.zeros((1, 7))),
        ([0.0, 0.0], np.zeros((2, 7))),
        ([0.1, 0.2], np.zeros((2, 7))),
        ([0.0, NAN], np.zeros((2, 7))),
        ([0.0, 0.1], np.full((2, 7), NAN)),
        ([0.0, 0.1], np.zeros((2, 6))),
        ([0.0, 0.1], np.zeros((3, 7))),
        (None, np.zeros((2, 7))),
    ],
)
def test_a_motion_that_is_none_is_refused(times, positions):
    with pytest.raises(NetworkError):
        read_motion(_answer(times=times, positions=positions), 7)
