"""Directions worth trying: approaches within a cone about forward, and closing axes taken from the data."""

import numpy as np
from jaxtyping import Float, Int64
from numba import njit

from torc.grasping.config import CandidateConfig

_CLUSTER_COS = np.cos(np.deg2rad(20.0))
_MIN_CLUSTER_SHARE = 0.04
_MIN_SHADOW = 0.5


def approach_directions(forward: Float[np.ndarray, "3"], config: CandidateConfig) -> Float[np.ndarray, "a 3"]:
    """Straight down, and every tilt with every yaw about the vertical from `forward` (unit vectors)."""
    out = [np.array([0.0, 0.0, -1.0])]
    for tilt in config.tilts_rad:
        for yaw in config.yaws_rad:
            c, s = np.cos(yaw), np.sin(yaw)
            flat = np.array([c * forward[0] - s * forward[1], s * forward[0] + c * forward[1], 0.0])
            out.append(np.sin(tilt) * flat + np.array([0.0, 0.0, -np.cos(tilt)]))
    return np.array(out)


def normal_clusters(normals: Float[np.ndarray, "n 3"], limit: int) -> Float[np.ndarray, "k 3"]:
    """Mean directions (without sign) of groups of like surface normals, the largest group first.

    Greedy: the normal with most others within 20 degrees takes them all, and so on.
    """
    rest = normals[np.einsum("ij,ij->i", normals, normals) > 0.5]
    fewest = max(3.0, _MIN_CLUSTER_SHARE * len(rest))
    step = max(1, len(rest) // 60)
    out: list[np.ndarray] = []
    while len(out) < limit and len(rest) >= fewest:
        cosines = rest[::step] @ rest.T
        best = int(np.argmax((np.abs(cosines) > _CLUSTER_COS).sum(axis=1)))
        member = np.abs(cosines[best]) > _CLUSTER_COS
        if member.sum() < fewest:
            break
        mean = (rest[member] * np.sign(cosines[best][member])[:, None]).mean(axis=0)
        out.append(mean / np.linalg.norm(mean))
        rest = rest[~member]
    return np.array(out).reshape(-1, 3)


def closing_axes(
    approaches: Float[np.ndarray, "a 3"],
    points: Float[np.ndarray, "n 3"],
    clusters: Float[np.ndarray, "k 3"],
    view: Float[np.ndarray, "3"],
    merge_rad: float,
) -> tuple[Float[np.ndarray, "a c 3"], Int64[np.ndarray, "a"]]:
    """Closing axes per approach, perpendicular to it, and how many.

    From the normal clusters, the principal axes of the cloud as seen along the approach, and the horizontal
    across the approach with its perpendicular; axes within `merge_rad` of an earlier one are left out.
    """
    centered = points - points.mean(axis=0)
    axes = np.zeros((len(approaches), len(clusters) + 4, 3))
    counts = np.zeros(len(approaches), dtype=np.int64)
    _closing_axes(approaches, centered.T @ centered, clusters, view, float(np.cos(merge_rad)), axes, counts)
    return axes, counts


@njit(cache=True)
def _closing_axes(
    approaches: np.ndarray,
    covariance: np.ndarray,
    clusters: np.ndarray,
    view: np.ndarray,
    merged_cos: float,
    axes: np.ndarray,
    counts: np.ndarray,
) -> None:
    wanted = np.empty((len(clusters) + 4, 3))
    wanted[: len(clusters)] = clusters
    for i in range(len(approaches)):
        a = approaches[i]
        level, upright = np.empty(3), np.empty(3)
        flat = np.sqrt(a[0] ** 2 + a[1] ** 2)
        if flat > 1e-6:
            level[0], level[1], level[2] = a[1] / flat, -a[0] / flat, 0.0
        else:
            level[0], level[1], level[2] = -view[1], view[0], 0.0
        upright[0] = a[1] * level[2] - a[2] * level[1]
        upright[1] = a[2] * level[0] - a[0] * level[2]
        upright[2] = a[0] * level[1] - a[1] * level[0]
        # Principal axes of the cloud's shadow, in the basis (level, upright).
        c00, c01 = level @ (covariance @ level), level @ (covariance @ upright)
        angle = 0.5 * np.arctan2(2.0 * c01, c00 - upright @ (covariance @ upright))
        k = len(clusters)
        wanted[k] = np.cos(angle) * level + np.sin(angle) * upright
        wanted[k + 1] = np.cos(angle) * upright - np.sin(angle) * level
        wanted[k + 2], wanted[k + 3] = level, upright
        for w in range(len(wanted)):
            c = wanted[w] - np.sum(wanted[w] * a) * a
            norm = np.sqrt(np.sum(c**2))
            if norm < _MIN_SHADOW:
                continue
            c /= norm
            new = True
            for m in range(counts[i]):
                if abs(np.sum(axes[i, m] * c)) > merged_cos:
                    new = False
                    break
            if new:
                axes[i, counts[i]] = c
                counts[i] += 1
