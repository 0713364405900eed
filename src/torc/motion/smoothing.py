"""Shorten and round paths: shortcuts and rounded corners, all checked edge by edge; compiled."""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.collision.contact_kernels import edge_collides
from torc.collision.placement import scratch_for
from torc.geometry.transforms import kernel_array
from torc.motion.space import FreeSpace


@njit(cache=True)
def _at(path, cumulative, s, out):
    """Write the point at arc length s to out; return the index of its segment."""
    k = 0
    while k + 2 < cumulative.shape[0] and cumulative[k + 1] < s:
        k += 1
    length = cumulative[k + 1] - cumulative[k]
    t = (s - cumulative[k]) / length if length > 0 else 0.0
    for i in range(path.shape[1]):
        out[i] = path[k, i] + t * (path[k + 1, i] - path[k, i])
    return k


@njit(cache=True)
def _lengths(path, weights):
    cumulative = np.zeros(path.shape[0])
    for k in range(1, path.shape[0]):
        s = 0.0
        for i in range(path.shape[1]):
            s += (weights[i] * (path[k, i] - path[k - 1, i])) ** 2
        cumulative[k] = cumulative[k - 1] + np.sqrt(s)
    return cumulative


@njit(cache=True)
def _shortcut(path, draws, weights, scene):
    dof, scratch = path.shape[1], scratch_for(scene[1])
    a, b = np.empty(dof), np.empty(dof)
    for d in range(draws.shape[0]):
        if path.shape[0] < 3:
            break
        cumulative = _lengths(path, weights)
        total = cumulative[-1]
        s, e = min(draws[d, 0], draws[d, 1]) * total, max(draws[d, 0], draws[d, 1]) * total
        i, j = _at(path, cumulative, s, a), _at(path, cumulative, e, b)
        if i == j:
            continue
        if edge_collides(a, b, np.uint64(0), scene, scratch):
            continue
        new = np.empty((path.shape[0] - (j - i) + 2, dof))
        new[: i + 1] = path[: i + 1]
        new[i + 1], new[i + 2] = a, b
        new[i + 3 :] = path[j + 1 :]
        path = new
    return path


@njit(cache=True)
def _skip_waypoints(path, scene):
    """Go from each waypoint straight to the last one that can be reached."""
    scratch = scratch_for(scene[1])
    keep = np.zeros(path.shape[0], np.bool_)
    keep[0] = True
    i = 0
    while i < path.shape[0] - 1:
        j = path.shape[0] - 1
        while j > i + 1 and edge_collides(path[i], path[j], np.uint64(0), scene, scratch):
            j -= 1
        keep[j] = True
        i = j
    return path[keep]


@njit(cache=True)
def _arc(before, corner, after, d, samples, out):
    """Write points of the quadratic Bezier arc that leaves the corner out by d on either side."""
    u, v = before - corner, after - corner
    first = corner + u * (d / np.linalg.norm(u))
    last = corner + v * (d / np.linalg.norm(v))
    for i in range(samples):
        t = i / (samples - 1)
        out[i] = (1 - t) ** 2 * first + 2 * t * (1 - t) * corner + t * t * last


@njit(cache=True)
def _corner_blends(path, blend_rad, samples, scene):
    m, dof = path.shape
    scratch = scratch_for(scene[1])
    arc = np.empty((samples, dof))
    blends = np.zeros(m)
    for k in range(1, m - 1):
        before, after = np.linalg.norm(path[k] - path[k - 1]), np.linalg.norm(path[k + 1] - path[k])
        d = min(blend_rad, 0.5 * before, 0.5 * after)
        if d < 1e-6:
            continue
        for _ in range(6):
            _arc(path[k - 1], path[k], path[k + 1], d, samples, arc)
            i = 0
            while i < samples - 1 and not edge_collides(arc[i], arc[i + 1], np.uint64(0), scene, scratch):
                i += 1
            if i == samples - 1:
                blends[k] = d
                break
            d *= 0.5
    return blends


def shortcut(
    path: Float[np.ndarray, "m dof"], rounds: int, space: FreeSpace, rng: np.random.Generator
) -> Float[np.ndarray, "k dof"]:
    """Return a shorter free path: skip waypoints, join random points of the path by free edges, skip again."""
    draws = rng.random((rounds, 2))
    path = _skip_waypoints(kernel_array(path), space.scene)
    path = _shortcut(path, draws, space.weights, space.scene)
    return _skip_waypoints(path, space.scene)


def corner_blends(
    path: Float[np.ndarray, "m dof"], blend_rad: float, space: FreeSpace, samples: int = 7
) -> Float[np.ndarray, "m"]:
    """Return how far from each corner its arc may begin: at most blend_rad and half a leg, halved until it is free.

    0 at both ends and where even a small arc is not free.
    """
    return _corner_blends(kernel_array(path), blend_rad, samples, space.scene)
