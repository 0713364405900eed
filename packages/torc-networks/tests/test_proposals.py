"""Overlapping masks become one number per pixel by rules that a reader can check."""

import numpy as np
import pytest

from torc.errors import InputError
from torc_networks.proposals import LayoutConfig, Proposals, lay_out, plausible, shared_pixels

SHAPE = (60, 80)
CONFIG = LayoutConfig(min_pixels=4)


def mask(top, left, bottom, right):
    out = np.zeros(SHAPE, bool)
    out[top:bottom, left:right] = True
    return out


def proposals(*found):
    """Each as (mask, score) or (mask, score, wanted)."""
    masks = np.array([f[0] for f in found], bool).reshape(-1, *SHAPE)
    scores = np.array([f[1] for f in found], np.float32)
    wanted = np.array([f[2] if len(f) > 2 else 0 for f in found], np.float32)
    return Proposals(masks, scores, wanted)


def laid(*found, config=CONFIG):
    return lay_out(proposals(*found), config)


def regions(masks):
    """The pixels of each number, in its order."""
    return [masks.label == k for k in range(int(masks.label.max()) + 1)]


def test_masks_that_do_not_touch_stay_and_the_largest_comes_first():
    small, large = mask(0, 0, 5, 5), mask(20, 20, 40, 40)
    found = laid((small, 0.9), (large, 0.4))
    assert np.array_equal(found.label == 0, large)
    assert np.array_equal(found.label == 1, small)
    assert found.sureness == pytest.approx([0.4, 0.9])


def test_no_masks_are_no_masks():
    found = laid()
    assert (found.label == -1).all()
    assert found.sureness.shape == (0,)
    assert (found.wanted_p == 0).all()


def test_of_doubles_the_surer_one_stays_and_is_the_target_if_its_double_was():
    a, b = mask(0, 0, 20, 20), mask(0, 0, 20, 22)
    found = laid((a, 0.5, 0.8), (b, 0.6))
    assert np.array_equal(found.label == 0, b)
    assert found.label.max() == 0
    assert found.wanted_p[b] == pytest.approx(0.8)
    assert (found.wanted_p[~b] == 0).all()


def test_of_doubles_with_equal_scores_the_smaller_one_stays():
    a, b = mask(0, 0, 20, 20), mask(0, 0, 20, 22)
    for order in ((a, b), (b, a)):
        assert np.array_equal(laid(*((m, 0.5) for m in order)).label == 0, a)


def test_where_masks_overlap_the_smaller_one_is_on_top_whatever_the_scores():
    behind, before = mask(0, 0, 30, 30), mask(20, 20, 38, 38)
    for scores in ((0.9, 0.3), (0.3, 0.9)):
        found = laid(*zip((behind, before), scores))
        assert np.array_equal(found.label == 0, behind & ~before)
        assert np.array_equal(found.label == 1, before)


def test_a_heap_is_not_one_object_however_sure_it_is():
    heap, left, right = mask(0, 0, 20, 40), mask(0, 0, 20, 19), mask(0, 20, 20, 40)
    found = laid((heap, 0.99), (left, 0.4), (right, 0.3))
    assert [r.sum() for r in regions(found)] == [400, 380]
    assert np.array_equal(found.label >= 0, left | right)


def test_a_part_of_a_surer_object_is_no_object_and_a_surer_part_is():
    can, label = mask(0, 0, 20, 40), mask(5, 5, 15, 15)
    assert np.array_equal(laid((can, 0.6), (label, 0.5)).label == 0, can)
    assert laid((can, 0.6), (label, 0.5)).label.max() == 0
    found = laid((can, 0.5), (label, 0.6))
    assert np.array_equal(found.label == 1, label)


def test_what_is_called_the_target_is_no_part():
    box, on_it = mask(0, 0, 20, 40), mask(5, 5, 15, 15)
    found = laid((box, 0.6), (on_it, 0.5, 0.5))
    assert np.array_equal(found.label == 1, on_it)
    assert np.array_equal(found.wanted_p > 0, on_it)


def test_one_that_loses_most_of_its_pixels_is_dropped():
    under, over = mask(0, 0, 20, 20), mask(0, 0, 20, 13)
    config = LayoutConfig(min_pixels=4, same_iou=0.9)
    found = laid((under, 0.3), (over, 0.9), config=config)
    assert np.array_equal(found.label == 0, over)
    assert found.label.max() == 0


def test_tiny_ones_are_dropped_and_so_is_what_overlap_makes_tiny():
    config = LayoutConfig(min_pixels=31)
    assert laid((mask(0, 0, 5, 5), 0.9), config=config).label.max() == -1
    found = laid((mask(0, 0, 6, 8), 0.9), (mask(0, 5, 6, 12), 0.9), config=config)
    assert found.label.max() == 0


def test_the_order_of_masks_does_not_matter(rng):
    found = []
    for _ in range(40):
        top, left = rng.integers(0, 40), rng.integers(0, 60)
        found.append((mask(top, left, top + rng.integers(3, 20), left + rng.integers(3, 20)), rng.random()))
    wanted = laid(*found).label
    for _ in range(5):
        rng.shuffle(found)
        assert np.array_equal(laid(*found).label, wanted)


def test_laying_out_what_was_laid_out_changes_nothing(rng):
    found = []
    for _ in range(200):
        top, left = rng.integers(0, 50), rng.integers(0, 70)
        found.append((mask(top, left, top + rng.integers(2, 12), left + rng.integers(2, 12)), rng.random()))
    once = laid(*found)
    assert once.label.max() > 5
    again = lay_out(proposals(*zip(regions(once), once.sureness)), CONFIG)
    assert np.array_equal(again.label, once.label)
    assert np.array_equal(again.sureness, once.sureness)


def test_shared_pixels_are_counted_as_one_would(rng):
    masks = rng.random((7, 13, 11)) < 0.4  # sizes that fill no machine word
    plain = [[int((a & b).sum()) for b in masks] for a in masks]
    assert np.array_equal(shared_pixels(masks), plain)
    assert shared_pixels(np.zeros((0, 13, 11), bool)).shape == (0, 0)


def kept(found, read=None, rises=None, **settings):
    """Indices of the proposals that can be objects; their scores tell which is which."""
    read = np.ones(SHAPE, bool) if read is None else read
    rises = np.ones(SHAPE, bool) if rises is None else rises
    out = plausible(proposals(*found), read, rises, LayoutConfig(min_pixels=4, **settings))
    return [round(float(s), 3) for s in out.scores]


def test_the_table_and_what_lies_flat_or_outside_is_no_object():
    table, wall, thing = mask(0, 0, 60, 80), mask(0, 0, 10, 20), mask(30, 30, 40, 40)
    rises = mask(28, 28, 45, 45)
    assert kept([(table, 0.9), (wall, 0.8), (thing, 0.7)], rises=rises) == [0.7]


def test_a_mask_may_be_as_large_as_the_setting_says():
    third = mask(0, 0, 20, 80)
    assert kept([(third, 0.5)], most_share=0.34) == [0.5]
    assert kept([(third, 0.5)], most_share=0.33) == []


def test_only_pixels_with_a_reading_count_and_none_at_all_are_no_object():
    thing = mask(30, 30, 40, 40)
    rises = mask(30, 30, 33, 40)
    assert kept([(thing, 0.5)], rises=rises) == []
    assert kept([(thing, 0.5)], read=mask(30, 30, 35, 40), rises=rises) == [0.5]
    assert kept([(thing, 0.5)], read=np.zeros(SHAPE, bool), rises=np.zeros(SHAPE, bool)) == []


def test_scores_that_are_no_numbers_are_no_scores():
    a, b, c = mask(0, 0, 9, 9), mask(20, 0, 29, 9), mask(40, 0, 49, 9)
    assert kept([(a, np.nan), (b, 0.5), (c, np.inf)]) == [0.5]


def test_settings_that_mean_nothing_are_refused():
    with pytest.raises(InputError, match="same_iou"):
        LayoutConfig(same_iou=1.5)
    with pytest.raises(InputError, match="min_pixels"):
        LayoutConfig(min_pixels=0)
