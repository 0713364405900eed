"""Convex pieces with few corners."""

import numpy as np
from jaxtyping import Float

_MIN_VOLUME_M3 = 2e-9
_MIN_THICKNESS_M = 3e-4


def reduced_hull(points: Float[np.ndarray, "n 3"], max_vertices: int) -> Float[np.ndarray, "k 3"]:
    """At most max_vertices corners of the convex hull: always the one that sticks out farthest comes next."""
    from scipy.spatial import ConvexHull

    corners = points[ConvexHull(points).vertices]
    if len(corners) <= max_vertices:
        return np.asarray(corners)
    chosen = _extremes(corners)
    while len(chosen) < max_vertices:
        planes = ConvexHull(corners[chosen]).equations
        outside = (corners @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        farthest = int(np.argmax(outside))
        if farthest in chosen:
            break
        chosen.append(farthest)
    return np.asarray(corners[chosen])


def thinned(points: Float[np.ndarray, "n 3"], max_points: int) -> Float[np.ndarray, "k 3"]:
    """Points that stick out farthest in max_points directions, spread evenly, the axes among them; all if they are few.

    For the corners of a hull that `reduced_hull` would take too long for: the bounding box stays.
    """
    if len(points) <= max_points:
        return points
    k = np.arange(max_points - 6) + 0.5
    z, turn = 1.0 - 2.0 * k / len(k), k * np.pi * (3.0 - np.sqrt(5.0))  # a Fibonacci lattice
    r = np.sqrt(1.0 - z**2)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    directions = np.concatenate([axes, np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)])
    blocks = np.array_split(directions, 16)  # all at once would take a gigabyte
    return points[np.unique(np.concatenate([np.argmax(points @ block.T, axis=0) for block in blocks]))]


def _extremes(corners: np.ndarray) -> list[int]:
    """The extreme corners along the axes: the bounding box stays."""
    found = dict.fromkeys(
        int(i) for k in range(3) for i in (np.argmin(corners[:, k]), np.argmax(corners[:, k]))
    )
    order = [*found]
    # The first four must not lie in a plane.
    for i in range(len(corners)):
        if len(order) >= 4 and np.linalg.matrix_rank(corners[order] - corners[order[0]], tol=1e-6) == 3:
            break
        if i not in found:
            order.append(i)
    return order


def solid_enough(points: Float[np.ndarray, "n 3"]) -> bool:
    """Whether a piece is thick enough for contacts."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return False
    # Thinnest across one of its own faces.
    reach = points @ hull.equations[:, :3].T
    return bool(hull.volume > _MIN_VOLUME_M3 and np.ptp(reach, axis=0).min() > _MIN_THICKNESS_M)
