"""How long a cloud of points is."""

import numpy as np
from jaxtyping import Float

_DIRECTIONS = 64
_MOST_POINTS = 1500


def longest_m(points: Float[np.ndarray, "n 3"], trimmed: float = 0.0) -> float:
    """The longest extent in any direction, metres, to within a percent; 0 for no point. `trimmed`: a share of the
    points that counts for nothing at either end, since depth flies at edges; of many points only some count then.
    """
    if len(points) == 0:
        return 0.0
    some = points[:: -(-len(points) // _MOST_POINTS)] if trimmed else points
    along = np.asarray(some, float) @ _hemisphere().T
    low, high = np.quantile(along, [trimmed, 1 - trimmed], axis=0)
    return float((high - low).max())


def _hemisphere() -> Float[np.ndarray, "k 3"]:
    """Directions spread evenly over half of a sphere (a Fibonacci spiral)."""
    k = np.arange(_DIRECTIONS) + 0.5
    z = k / _DIRECTIONS
    turn = np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
