"""Whatever comes in, kernels get one kind of array."""

import numpy as np
import pytest

from torc.geometry.arrays import kernel_array


def test_an_array_that_is_right_is_not_copied():
    array = np.arange(6.0).reshape(2, 3)
    assert kernel_array(array) is array
    labels = np.zeros((3, 4), dtype=np.int16)
    assert kernel_array(labels, np.int16) is labels


@pytest.mark.parametrize(
    "array",
    [
        np.asfortranarray(np.arange(12).reshape(3, 4)),
        np.arange(24).reshape(4, 6)[::2, ::3],
        np.broadcast_to(np.arange(3.0), (1, 3)),
        np.broadcast_to(np.arange(3.0), (5, 3)),
        np.frombuffer(np.arange(4.0).tobytes()),
        np.arange(3, dtype=">f8"),
        [[1, 2], [3, 4]],
        np.zeros((0, 3), dtype=np.float32),
    ],
)
def test_all_others_become_plain(array):
    out = kernel_array(array)
    np.testing.assert_array_equal(out, array)
    assert out.dtype == np.float64
    assert out.dtype.isnative
    assert out.flags.c_contiguous
    assert out.flags.writeable
    assert out.flags.aligned
