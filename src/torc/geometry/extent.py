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
    return Extent(_longest(some, spiral(_DIRECTIONS, half=True), trimmed), _thickness(some, trimmed))


def _thickness(points: Float[np.ndarray, "n 3"], trimmed: float) -> float:
    """Return the width of the narrowest tube, whose direction is searched near the cloud's principal axes."""
    axes = np.linalg.svd(points[:: -(-len(points) // _MOST_POINTS)], full_matrices=False)[2]
    widths = [_across(points, axis, trimmed) for axis in axes]
    along, best = axes[int(np.argmin(widths))], min(widths)
    for step in _STEPS_RAD:
        a, b = _aside(along)
        for turned in (along + step * a, along - step * a, along + step * b, along - step * b):
            turned = turned / np.linalg.norm(turned)
            if (width := _across(points, turned, trimmed)) < best:
                along, best = turned, width
    return best


def _across(points: Float[np.ndarray, "n 3"], along: Float[np.ndarray, "3"], trimmed: float) -> float:
    """Return the longest extent at right angles to a direction."""
    a, b = _aside(along)
    turn = np.pi * np.arange(_AROUND)[:, None] / _AROUND
    return _longest(points, np.cos(turn) * a + np.sin(turn) * b, trimmed)


def _aside(along: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    a = np.cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))
    a /= np.linalg.norm(a)
    return a, np.cross(along, a)


def _longest(points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "k 3"], trimmed: float) -> float:
    at = np.sort(points @ directions.T, axis=0)
    left_out = int(trimmed * len(points))
    return float((at[len(at) - 1 - left_out] - at[left_out]).max())


@cache
def spiral(n: int, half: bool = False) -> Float[np.ndarray, "n 3"]:
    """Return unit vectors spread evenly over a sphere, or over its upper half (a Fibonacci spiral)."""
    k = np.arange(n) + 0.5
    z, turn = k / n if half else 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
