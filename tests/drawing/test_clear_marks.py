"""Marks that hide as little as they can."""

import cv2
import numpy as np
import pytest

from torc.drawing.clear_marks import MOST_COVERED, mark_clearly, neighbour_colors, piece_links

GREY = 120


def _picture(shape=(300, 400)):
    return np.full((*shape, 3), GREY, np.uint8), np.full(shape, -1, np.int16)


def _stripes(count, width):
    """Objects side by side, each touching the next."""
    rgb, label = _picture()
    for i in range(count):
        label[100:200, 20 + i * width : 20 + (i + 1) * width] = i
    return rgb, label


@pytest.mark.parametrize("width", [1, 2, 3, 5, 8, 40])
def test_an_outline_never_eats_an_object_however_thin(width):
    rgb, label = _picture()
    label[50:250, 200 : 200 + width] = 3
    image = mark_clearly(rgb, label, {3: 3})
    mask = label == 3
    rows = slice(210, 240)  # away from number and line
    changed = np.any(image != rgb, axis=2)
    assert np.count_nonzero(changed[rows] & mask[rows]) <= (MOST_COVERED + 0.05) * np.count_nonzero(
        mask[rows]
    )
    beside = changed[rows, 200 - 6 : 200 + width + 6]
    assert beside.any()


def test_an_outline_covers_no_other_object():
    rgb, label = _stripes(9, 3)
    for i in range(9):
        image = mark_clearly(rgb, label, {i: i})
        others = (label >= 0) & (label != i)
        others[:170] = False  # away from number and line
        assert not np.any(image[others] != GREY)


@pytest.mark.parametrize("ids", [range(16), range(10, 26), (0, 1, 5, 9, 11, 47, 63)])
def test_neighbours_have_colours_that_differ(ids):
    _, label = _picture()
    for n, i in enumerate(ids):
        row, col = divmod(n, 4)
        label[20 + 60 * row : 78 + 60 * row, 20 + 60 * col : 78 + 60 * col] = i
    colors = neighbour_colors(label, tuple(ids))
    assert set(colors) == set(ids)
    lab = {
        i: cv2.cvtColor(np.array([[c]], np.float32) / 255, cv2.COLOR_RGB2LAB)[0, 0] for i, c in colors.items()
    }
    places = {i: divmod(n, 4) for n, i in enumerate(ids)}
    for i, (row, col) in places.items():
        for k, (r, c) in places.items():
            if k != i and max(abs(r - row), abs(c - col)) == 1:
                assert np.linalg.norm(lab[i] - lab[k]) > 30, (i, k)
    assert [i for i, color in colors.items() if color == (0xE1, 0x19, 0x23)] == [i for i in ids if i == 0]


def test_links_join_all_pieces_by_their_nearest_pixels_and_leave_out_specks():
    mask = np.zeros((100, 200), bool)
    mask[40:60, 10:40] = mask[40:60, 60:90] = mask[40:60, 120:150] = True
    mask[5, 5] = True  # a speck
    links = list(piece_links(mask))
    lengths = sorted(round(float(np.hypot(a[0] - b[0], a[1] - b[1]))) for a, b in links)
    assert lengths == [21, 31]
    assert all(mask[a] and mask[b] for a, b in links)
    assert list(piece_links(np.zeros((9, 9), bool))) == []


def test_pieces_of_one_object_are_linked_in_its_colour():
    rgb, label = _picture()
    label[100:160, 20:90] = 4
    label[100:160, 90:200] = 2
    label[100:160, 200:260] = 4
    image = mark_clearly(rgb, label, {2: 2, 4: 4})
    color = neighbour_colors(label, (2, 4))[4]
    between = image[100:160, 95:195].reshape(-1, 3)
    assert np.all(between == color, axis=1).any()


@pytest.mark.parametrize("side", [6, 10, 30, 50])
def test_numbers_keep_off_small_objects(side):
    rgb, label = _picture()
    label[100 : 100 + side, 100 : 100 + side] = 7
    label[100 + side + 3 : 100 + 2 * side, 100 : 100 + side] = 8
    image = mark_clearly(rgb, label, {7: 7, 8: 8})
    for i in (7, 8):
        mask = label == i
        # Its own line alone; digits are white.
        assert not np.any(np.all(image[mask] == 255, axis=1))
        assert np.count_nonzero(np.all(image[mask] == 0, axis=1)) <= 0.35 * np.count_nonzero(mask)
