"""Masks against true ones, by hand counts."""

import numpy as np
import pytest

from torc.perception.scoring import mean_score, outline, score_masks


def picture(*boxes, shape=(40, 60)):
    """Labels 0, 1, ... in boxes (rows from, to, columns from, to), later ones over earlier ones."""
    label = np.full(shape, -1, np.int16)
    for i, (a, b, c, d) in enumerate(boxes):
        label[a:b, c:d] = i
    return label


def test_equal_masks_score_one_whatever_their_numbers():
    true = picture((5, 15, 5, 15), (20, 35, 30, 50))
    score = score_masks(np.where(true >= 0, 7 - true, -1).astype(np.int16), true)
    assert (score.overlap_f, score.boundary_f, score.f75) == (1, 1, 1)
    assert (score.merges, score.splits, score.missed) == (0, 0, 0)


def test_overlap_counts_pixels_of_matched_masks():
    true = picture((0, 10, 0, 10), (20, 30, 0, 10))
    found = picture((0, 10, 0, 5), (20, 30, 0, 20))
    score = score_masks(found, true)
    # Common: 50 + 100; found: 50 + 200; true: 100 + 100.
    assert score.overlap_p == pytest.approx(150 / 250)
    assert score.overlap_r == pytest.approx(150 / 200)
    assert score.overlap_f == pytest.approx(2 * 0.6 * 0.75 / 1.35)
    # F of the pairs: 2 * 50 / 150 and 2 * 100 / 300.
    assert score.f75 == 0


def test_masks_are_matched_for_the_largest_sum_not_greedily():
    true = picture((0, 10, 0, 10), (0, 10, 10, 20))
    found = picture((0, 10, 0, 13), (0, 4, 13, 20))
    score = score_masks(found, true)
    assert score.overlap_p == pytest.approx((100 + 28) / 158)


def test_boundaries_may_be_a_pixel_off_and_no_more():
    true = picture((10, 30, 10, 40))
    assert score_masks(picture((10, 30, 11, 41)), true).boundary_f == 1
    far = score_masks(picture((10, 30, 14, 44)), true)
    assert far.boundary_f < 0.7 < far.overlap_f


def test_a_merge_holds_most_of_two_and_a_split_is_in_two():
    true = picture((0, 10, 0, 10), (0, 10, 10, 20), (20, 30, 0, 20))
    found = picture((0, 10, 0, 20), (20, 30, 0, 10), (20, 30, 10, 20))
    score = score_masks(found, true)
    assert score.merges == pytest.approx(1 / 3)
    assert score.splits == pytest.approx(1 / 3)
    assert score.missed == 0


def test_what_no_mask_holds_is_missed():
    score = score_masks(picture((0, 10, 0, 10)), picture((0, 10, 0, 10), (20, 30, 20, 40)))
    assert score.missed == 0.5
    assert score.f75 == 0.5


def test_nothing_where_nothing_is_is_right_and_something_is_wrong():
    empty = picture()
    assert score_masks(empty, empty).overlap_f == 1
    assert score_masks(picture((0, 5, 0, 5)), empty).overlap_f == 0
    nothing = score_masks(empty, picture((0, 5, 0, 5)))
    assert (nothing.overlap_f, nothing.f75, nothing.missed) == (0, 0, 1)


def test_the_edge_of_the_picture_is_no_outline():
    mask = np.ones((4, 6), bool)
    assert not outline(mask).any()
    mask[:, 3:] = False
    assert outline(mask)[:, 2].all()
    assert outline(mask).sum() == 4


def test_the_mean_is_over_pictures():
    good, bad = (
        score_masks(picture((0, 5, 0, 5)), picture((0, 5, 0, 5))),
        score_masks(picture(), picture((0, 5, 0, 5))),
    )
    assert mean_score([good, good, bad]).overlap_f == pytest.approx(2 / 3)
    with pytest.raises(ValueError, match="no score"):
        mean_score([])
