"""Compare the size of things in sight with that of the target."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from torc.geometry.extent import Extent, extent

_FLYING = 0.02
"""Share of an object's points that may be flying points at edges."""
_LEAST_M = 0.005


def size_in_sight(points: Float[np.ndarray, "n 3"]) -> Extent:
    """Return length and thickness of a cloud, metres: least values, since hidden parts are missing."""
    return extent(points, _FLYING)


def stretch(seen_m: Sequence[tuple[float, float]], told_m: tuple[float, float]) -> Float[np.ndarray, "n 2"]:
    """Return logarithms of how much longer and thicker things look than the target is."""
    sizes_m = np.array(seen_m).reshape(-1, 2)
    return np.asarray(np.log(np.maximum(sizes_m, _LEAST_M) / np.maximum(told_m, _LEAST_M)))
