"""Arrays for compiled kernels, always of one kind."""

import numpy as np
from numpy.typing import ArrayLike, DTypeLike


def kernel_array(array: ArrayLike, dtype: DTypeLike = np.float64) -> np.ndarray:
    """The array in C order, of one data type, and writable; copied only where it is not.

    numba compiles a kernel again, which takes seconds, for every other memory order, data type or protection of an
    argument. What comes from outside, or from a function whose memory order depends on the number of rows
    (`np.broadcast_to`, `np.argwhere`), goes through here on its way to a kernel.
    """
    out = np.ascontiguousarray(array, dtype=dtype)
    return out if out.flags.writeable else out.copy()
