"""Choose directions to try: approaches within a cone about forward, and closing axes taken from the data."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.geometry.transforms import kernel_array
from torc.grasping.config import CandidateConfig

_CLUSTER_COS = np.cos(np.deg2rad(20.0))
_MIN_CLUSTER_SHARE = 0.04
_MAX_SLANT = 0.5
_MAX_RISE = 0.1
_STEEP = 0.35


def approach_directions(forward: Float[np.ndarray, "3"], config: CandidateConfig) -> Float[np.ndarray, "a 3"]:
    """Return straight down, and every tilt with every yaw about the vertical from `forward` (unit vectors)."""
    return _directions(tuple(forward.tolist()), tuple(config.tilts_rad), tuple(config.yaws_rad))


@lru_cache(maxsize=16)
def _directions(
    forward: tuple[float, ...], tilts_rad: tuple[float, ...], yaws_rad: tuple[float, ...]
) -> Float[np.ndarray, "a 3"]:
    out = [np.array([0.0, 0.0, -1.0])]
    for tilt in tilts_rad:
        for yaw in yaws_rad:
            c, s = np.cos(yaw), np.sin(yaw)
            flat = np.array([c * forward[0] - s * forward[1], s * forward[0] + c * forward[1], 0.0])
            out.append(np.sin(tilt) * flat + np.array([0.0, 0.0, -np.cos(tilt)]))
    return np.array(out)


def normal_clusters(normals: Float[np.ndarray, "n 3"], limit: int) -> Float[np.ndarray, "k 3"]:
    """Return mean directions (without sign) of groups of similar surface normals, the largest group first.

    Greedy: the normal with most others within 20 degrees takes them all, and so on, `limit` times at most.
    """
    return np.array([m / np.linalg.norm(m) for m in _cluster_means(kernel_array(normals), limit)]).reshape(
        -1, 3
    )


@njit(cache=True, nogil=True)
def _cluster_means(normals, limit):
    rest, n = np.empty((len(normals), 3)), 0
    for i in range(len(normals)):
        if normals[i, 0] ** 2 + normals[i, 1] ** 2 + normals[i, 2] ** 2 > 0.5:
            rest[n] = normals[i]
            n += 1
    fewest, step = max(3.0, _MIN_CLUSTER_SHARE * n), max(1, n // 60)
    out, found = np.empty((limit, 3)), 0
    while found < limit and n >= fewest:
        best, most = 0, -1
        for i in range(0, n, step):
            count = 0
            for j in range(n):
                cosine = rest[i, 0] * rest[j, 0] + rest[i, 1] * rest[j, 1] + rest[i, 2] * rest[j, 2]
                count += abs(cosine) > _CLUSTER_COS
            if count > most:
                best, most = i, count
        if most < fewest:
            break
        x, y, z = rest[best, 0], rest[best, 1], rest[best, 2]
        mean, kept = np.zeros(3), 0
        for j in range(n):
            cosine = x * rest[j, 0] + y * rest[j, 1] + z * rest[j, 2]
            if abs(cosine) > _CLUSTER_COS:
                mean += rest[j] * np.sign(cosine)
            else:
                rest[kept] = rest[j]
                kept += 1
        out[found] = mean / most
        found, n = found + 1, kept
    return out[:found]


def grasp_frames(
    approaches: Float[np.ndarray, "a 3"],
    points: Float[np.ndarray, "n 3"],
    clusters: Float[np.ndarray, "k 3"],
    view: Float[np.ndarray, "3"],
    forward: Float[np.ndarray, "3"],
    config: CandidateConfig,
) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, "f 3"], int]:
    """Return pairs of perpendicular closing axis and approach, those of the first approach in front.

    Closing axes per approach: first the mean normals of clusters, with the approach turned perpendicular (by up to 30
    degrees: pads flat on a face matter more than a round angle of approach). Then, turned perpendicular to the approach
    themselves, the principal axes of the cloud as seen along it, and the horizontal with its perpendicular. Closing
    axes close to an earlier one of that approach are left out, and so are approaches turned out of the cone about
    `forward`.

    Returns:
        Closing axes, approaches, and how many belong to the first approach.
    """
    centered = points - points.mean(axis=0)
    merged_cos, yaw_cos = float(np.cos(config.closing_merge_rad)), float(np.cos(config.max_yaw_rad))
    return _grasp_frames(approaches, centered.T @ centered, clusters, view, forward, merged_cos, yaw_cos)


@njit(cache=True, nogil=True)
def _grasp_frames(approaches, covariance, clusters, view, forward, merged_cos, yaw_cos):
    k = len(clusters)
    most = len(approaches) * (k + 4)
    closings, turned = np.zeros((most, 3)), np.zeros((most, 3))
    wanted = np.empty((k + 4, 3))
    wanted[:k] = clusters
    n = first = 0
    for i in range(len(approaches)):
        a = approaches[i]
        _axes_of_shadow(a, covariance, view, wanted[k:])
        start = n
        for w in range(k + 4):
            slant = np.sum(wanted[w] * a)
            if abs(slant) > _MAX_SLANT:
                continue
            if w < k:
                closing, approach = wanted[w], a - slant * wanted[w]
                approach = approach / np.sqrt(np.sum(approach**2))
            else:
                closing, approach = wanted[w] / np.sqrt(np.sum(wanted[w] ** 2)), a
            new = in_cone(approach, forward, yaw_cos)
            for m in range(start, n):
                if abs(np.sum(closings[m] * closing)) > merged_cos:
                    new = False
                    break
            if new:
                closings[n], turned[n] = closing, approach
                n += 1
        if i == 0:
            first = n
    return closings[:n], turned[:n], first


@njit(cache=True)
def in_cone(approach, forward, yaw_cos):
    """Check whether an approach does not rise (by more than 6 degrees) and leads forward, within a yaw.

    The yaw of one within 20 degrees of straight down does not matter.
    """
    flat = np.sqrt(approach[0] ** 2 + approach[1] ** 2)
    if approach[2] > _MAX_RISE:
        return False
    return flat < _STEEP or approach[0] * forward[0] + approach[1] * forward[1] >= yaw_cos * flat


@njit(cache=True)
def _axes_of_shadow(a, covariance, view, out):
    """Write the principal axes of a cloud as seen along `a`, then the horizontal across `a` and its perpendicular."""
    level, upright = out[2], out[3]
    flat = np.sqrt(a[0] ** 2 + a[1] ** 2)
    if flat > 1e-6:
        level[0], level[1], level[2] = a[1] / flat, -a[0] / flat, 0.0
    else:
        level[0], level[1], level[2] = -view[1], view[0], 0.0
    upright[0] = a[1] * level[2] - a[2] * level[1]
    upright[1] = a[2] * level[0] - a[0] * level[2]
    upright[2] = a[0] * level[1] - a[1] * level[0]
    c00, c01, c11 = 0.0, 0.0, 0.0
    for p in range(3):
        for q in range(3):
            c00 += level[p] * covariance[p, q] * level[q]
            c01 += level[p] * covariance[p, q] * upright[q]
            c11 += upright[p] * covariance[p, q] * upright[q]
    angle = 0.5 * np.arctan2(2.0 * c01, c00 - c11)
    for p in range(3):
        out[0, p] = np.cos(angle) * level[p] + np.sin(angle) * upright[p]
        out[1, p] = np.cos(angle) * upright[p] - np.sin(angle) * level[p]
