"""How long things in sight are, beside how long the target is."""

import numpy as np
from jaxtyping import Float

from torc.geometry.extent import longest_m

_FLYING = 0.02
"""Share of an object's points that may fly off at edges."""
_LEAST_M = 0.005


def length_in_sight_m(points: Float[np.ndarray, "n 3"]) -> float:
    """Length of a cloud, metres. What others hide is missing, so an object is at least so long."""
    return longest_m(points, _FLYING)


def stretch(seen_m: Float[np.ndarray, "n"], told_m: float | None) -> Float[np.ndarray, "n"]:
    """Logarithm of how much longer things look than the target is; 0 where nobody told how long that is."""
    if told_m is None:
        return np.zeros(len(seen_m))
    return np.asarray(np.log(np.maximum(seen_m, _LEAST_M) / max(told_m, _LEAST_M)))
