"""Masks from affinities: with true ones the true masks come out, whatever the scene."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.embedded.instances import OFFSETS, InstanceConfig, find_instances, numbered
from torc.perception.scoring import score_masks
from torc.testing.synthetic import random_clutter, raycast


def affinities(label, sure=0.95):
    """What a network that is never wrong would say."""
    same = np.full((len(OFFSETS), *label.shape), 0.5, np.float32)
    height, width = label.shape
    for k, (dr, dc) in enumerate(OFFSETS):
        rows, cols = slice(0, height - dr), slice(max(0, -dc), width - max(0, dc))
        partner = label[dr:, max(0, dc) : width + min(0, dc)]
        alike = (label[rows, cols] == partner) & (partner >= 0)
        same[k][rows, cols] = np.where(alike, sure, 1 - sure)
    return np.where(label >= 0, np.float32(sure), np.float32(1 - sure)), same


def test_partners_lie_below_or_to_the_right_at_four_distances():
    assert len(set(OFFSETS)) == len(OFFSETS) == 14
    assert all(dr > 0 or (dr == 0 and dc > 0) for dr, dc in OFFSETS)


@pytest.mark.parametrize("seed", range(6))
def test_true_affinities_give_the_true_masks(seed):
    rng = np.random.default_rng(seed)
    label = raycast(random_clutter(rng, 14)).label_image[150:350, 200:560]
    visible, counts = np.unique(label[label >= 0], return_counts=True)
    true = np.where(np.isin(label, visible[counts >= 60]), label, -1).astype(np.int16)
    score = score_masks(find_instances(*affinities(true)).label, true)
    assert score.overlap_f > 0.97
    assert score.f75 > 0.85
    assert score.merges == 0


def test_parts_on_both_sides_of_something_in_front_are_one():
    label = np.full((60, 160), -1, np.int16)
    label[20:50, 10:150] = 1
    label[5:58, 60:90] = 2
    found = find_instances(*affinities(label)).label
    assert len(np.unique(found[label == 1])) == 1
    assert found[30, 20] == found[30, 140] != found[30, 75]


@pytest.mark.parametrize("wide", [3, 4, 6])
def test_a_strip_beside_something_large_is_not_swallowed(wide):
    label = np.full((60, 110), -1, np.int16)
    label[10:50, 10:60], label[10:50, 60 : 60 + wide] = 0, 1
    for turned in (label, label.T, label[:, ::-1]):
        found = find_instances(*affinities(np.ascontiguousarray(turned))).label
        assert len(np.unique(found[turned == 0])) == 1
        assert len(np.unique(found[turned == 1])) == 1
        assert not set(found[turned == 0]) & set(found[turned == 1])


def test_one_weak_spot_in_a_boundary_joins_nothing():
    label = np.full((60, 100), -1, np.int16)
    label[10:50, 10:50], label[10:50, 50:90] = 0, 1
    object_p, same = affinities(label)
    for k, (_, dc) in enumerate(OFFSETS):
        if dc > 0:
            same[k][25:31, 50 - dc : 50] = 0.99
    found = find_instances(object_p, same).label
    assert len(np.unique(found[found >= 0])) == 2


def test_small_masks_are_dropped_and_numbers_go_by_size():
    label = np.full((40, 60), -1, np.int16)
    label[5:10, 5:10], label[5:35, 20:50] = 0, 1
    found = find_instances(*affinities(label), InstanceConfig(min_pixels=30))
    assert set(np.unique(found.label)) == {-1, 0}
    assert len(found.sureness) == 1
    found = find_instances(*affinities(label), InstanceConfig(min_pixels=10))
    assert found.label[20, 30] == 0
    assert found.label[7, 7] == 1


def test_sureness_is_the_probabilities_that_speak_for_the_mask():
    label = np.full((40, 60), -1, np.int16)
    label[5:35, 10:30] = 0
    sure, doubtful = (find_instances(*affinities(label, p)).sureness[0] for p in (0.95, 0.7))
    assert sure == pytest.approx(0.95**2, abs=0.01)
    assert doubtful == pytest.approx(0.7**2, abs=0.01)


def test_nothing_gives_no_mask():
    found = find_instances(*affinities(np.full((64, 64), -1, np.int16)))
    assert (found.label == -1).all()
    assert len(found.sureness) == 0


def test_numbered_keeps_the_partition():
    rng = np.random.default_rng(0)
    label = rng.integers(-1, 9, (20, 30)).astype(np.int32)
    found = numbered(label, 1)
    assert ((found[:, :, None, None] == found) == (label[:, :, None, None] == label)).all()
    sizes = np.bincount(found[found >= 0])
    assert (np.diff(sizes) <= 0).all()


def test_probabilities_are_checked():
    with pytest.raises(InputError, match="probabilities"):
        InstanceConfig(same_p=1.5)
