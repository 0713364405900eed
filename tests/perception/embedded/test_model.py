"""Crops: the object fills the square, upright, on black, wherever and however large it is in the picture."""

import numpy as np
import pytest

from torc.perception.embedded.model import SIDE_PX, crop, descriptor_inputs


def drawn(scale, row, col):
    rgb = np.full((300, 400, 3), 77, np.uint8)
    mask = np.zeros((300, 400), bool)
    h, w = int(40 * scale), int(20 * scale)
    mask[row : row + h, col : col + w] = True
    rgb[row : row + h // 2, col : col + w] = [250, 0, 0]
    rgb[row + h // 2 : row + h, col : col + w] = [0, 0, 250]
    return rgb, mask


def test_place_and_size_do_not_matter():
    a, b = crop(*drawn(1, 10, 20)), crop(*drawn(5, 60, 250))
    assert a.shape == b.shape == (SIDE_PX, SIDE_PX, 4)
    assert np.abs(a.astype(int) - b.astype(int)).mean() < 6


def test_it_is_upright_and_stands_in_the_middle():
    out = crop(*drawn(2, 100, 100))
    rows, cols = np.nonzero(out[..., 3] > 127)
    assert abs(rows.mean() - (SIDE_PX - 1) / 2) < 1
    assert abs(cols.mean() - (SIDE_PX - 1) / 2) < 1
    assert 0.85 < (rows.max() - rows.min() + 1) / SIDE_PX < 0.95
    assert out[20, 32, 0] > 200
    assert out[44, 32, 2] > 200


def test_nothing_outside_of_the_mask_is_seen():
    rgb, mask = drawn(2, 100, 100)
    other = rgb.copy()
    other[~mask] = 255
    assert np.array_equal(crop(rgb, mask), crop(other, mask))


def test_inputs_are_zero_off_the_mask():
    out = descriptor_inputs(np.stack([crop(*drawn(2, 100, 100))]))
    assert out.shape == (1, 4, SIDE_PX, SIDE_PX)
    off = out[0, 3] == 0
    assert (out[0, :3, off] == 0).all()
    assert out.max() <= 1
    assert out.min() >= -1


def test_an_empty_mask_is_refused():
    with pytest.raises(ValueError, match="empty"):
        crop(np.zeros((10, 10, 3), np.uint8), np.zeros((10, 10), bool))
