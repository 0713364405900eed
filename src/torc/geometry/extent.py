"""Measure how long and how thick a cloud of points is."""

from functools import cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

_DIRECTIONS, _AROUND = 64, 12
_MOST_POINTS = 500
_STEPS_RAD = (0.2, 0.07, 0.025)


class Extent(NamedTuple):
    """The longest extent in any direction, and the width of the narrowest tube that it passes through, metres.

    For a part of a thing, neither is larger than for the whole.
    """

    length_m: float
    thickness_m: float


def extent(points: Float[np.ndarray, "n 3"], trimmed: float = 0.0) -> Extent:
    """Measure a cloud to within a few percent; 0 for no points.

    `trimmed`: share of the points that is ignored at either end, since depth has flying points at edges; large clouds
    are then subsampled.
    """
    if len(points) == 0:
        return Extent(0.0, 0.0)
    some = points[:: -(-len(points) // _MOST_POINTS)] if trimmed else points
    some = np.asarray(some, float) - some.mean(axis=0)
    length_m = float(_spans(some, spiral(_DIRECTIONS, half=True), trimmed).max())
    return Extent(length_m, _thickness(some, trimmed))


def _thickness(points: Float[np.ndarray, "n 3"], trimmed: float) -> float:
    """Return the width of the narrowest tube, whose direction is searched near the cloud's principal axes."""
    axes = np.linalg.svd(points[:: -(-len(points) // _MOST_POINTS)], full_matrices=False)[2]
    widths = _across(points, axes, trimmed)
    along, best = axes[int(np.argmin(widths))], widths.min()
    for step in _STEPS_RAD:
        a, b = _aside(along[None])
        turned = np.concatenate([along + step * a, along - step * a, along + step * b, along - step * b])
        turned = turned / _length(turned)
        widths = _across(points, turned, trimmed)
        if widths.min() < best:
            along, best = turned[int(np.argmin(widths))], widths.min()
    return float(best)


def _across(
    points: Float[np.ndarray, "n 3"], along: Float[np.ndarray, "k 3"], trimmed: float
) -> Float[np.ndarray, "k"]:
    """Return the longest extents at right angles to directions."""
    a, b = _aside(along)
    turn = np.pi * np.arange(_AROUND)[:, None] / _AROUND
    around = np.cos(turn) * a[:, None] + np.sin(turn) * b[:, None]
    return _spans(points, around.reshape(-1, 3), trimmed).reshape(-1, _AROUND).max(axis=1)


def _aside(along: Float[np.ndarray, "k 3"]) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3"]]:
    x, y, z = along.T
    a = np.where(np.abs(z) < 0.9, (y, -x, 0 * z), (0 * z, z, -y))
    a /= _length(a.T)[:, 0]
    return a.T, np.stack([y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]], axis=1)


def _length(vectors: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 1"]:
    return np.sqrt([[v @ v] for v in vectors])


def _spans(
    points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "k 3"], trimmed: float
) -> Float[np.ndarray, "k"]:
    """Return the extents along directions."""
    left_out = int(trimmed * len(points))
    at = np.sort(directions @ points.T, axis=1)
    return np.asarray(at[:, len(points) - 1 - left_out] - at[:, left_out])


@cache
def spiral(n: int, half: bool = False) -> Float[np.ndarray, "n 3"]:
    """Return unit vectors spread evenly over a sphere, or over its upper half (a Fibonacci spiral)."""
    k = np.arange(n) + 0.5
    z, turn = k / n if half else 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
