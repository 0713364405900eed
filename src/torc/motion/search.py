"""Search for free paths, then shorten and round them; compiled, and checked edge by edge.

The search is RRT-Connect (Kuffner and LaValle 2000): two trees grow towards samples and towards each other.
"""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.collision.contact_kernels import edge_collides
from torc.collision.placement import scratch_for
from torc.geometry.transforms import kernel_array
from torc.motion.config import SearchConfig
from torc.motion.space import FreeSpace, MotionQuery


@njit(cache=True)
def _nearest(nodes, count, q):
    best, nearest = 0, np.inf
    for k in range(count):
        d = 0.0
        for i in range(q.shape[0]):
            d += (nodes[k, i] - q[i]) ** 2
        if d < nearest:
            best, nearest = k, d
    return best, np.sqrt(nearest)


@njit(cache=True)
def _trace(nodes, parents, k):
    n = 1
    i = k
    while parents[i] >= 0:
        i = parents[i]
        n += 1
    path = np.empty((n, nodes.shape[1]))
    for j in range(n):
        path[j] = nodes[k]
        k = parents[k]
    return path


@njit(cache=True)
def _grow(nodes, parents, count, target, range_rad, greedy, scene, scratch):
    """Grow a tree from its nearest node towards a target: one edge, or (greedy) until it arrives or is stopped.

    Returns the new number of nodes and whether the last one is the target.
    """
    new, checking = scratch
    k, distance = _nearest(nodes, count, target)
    while distance > 0.0:
        share = min(1.0, range_rad / distance)
        for i in range(target.shape[0]):
            new[i] = nodes[k, i] + share * (target[i] - nodes[k, i]) if share < 1.0 else target[i]
        if edge_collides(nodes[k], new, np.uint64(0), scene, checking):
            return count, False
        nodes[count] = new
        parents[count] = k
        k, count = count, count + 1
        if share == 1.0 or not greedy:
            return count, share == 1.0
        distance -= range_rad
    return count, True


@njit(cache=True)
def _joined(nodes, parents, counts):
    """Return the path from the start through the last nodes of both trees, which are the same point, to a goal."""
    one = _trace(nodes[0], parents[0], counts[0] - 1)
    two = _trace(nodes[1], parents[1], counts[1] - 1)
    path = np.empty((one.shape[0] + two.shape[0] - 1, nodes.shape[2]))
    path[: one.shape[0]] = one[::-1]
    path[one.shape[0] :] = two[1:]
    return path


@njit(cache=True)
def _connect(start, goals, samples, range_rad, capacity, scene):
    """Return the path from start to a goal, without rows if the samples did not suffice."""
    dof = start.shape[0]
    scratch = np.empty(dof), scratch_for(scene[1])
    nodes = np.empty((2, capacity, dof))
    parents = np.full((2, capacity), -1)
    counts, rooted = np.array([1, 1]), 1
    nodes[0, 0], nodes[1, 0] = start, goals[0]
    for s in range(samples.shape[0]):
        if rooted < goals.shape[0] and 2 * rooted < counts[1]:
            nodes[1, counts[1]] = goals[rooted]
            counts[1], rooted = counts[1] + 1, rooted + 1
        tree, other = s % 2, 1 - s % 2
        before = counts[tree]
        counts[tree], _ = _grow(
            nodes[tree], parents[tree], before, samples[s], range_rad, False, scene, scratch
        )
        if counts[tree] == before:
            continue
        target = nodes[tree, before].copy()
        counts[other], met = _grow(
            nodes[other], parents[other], counts[other], target, range_rad, True, scene, scratch
        )
        if met:
            return _joined(nodes, parents, counts)
    return np.empty((0, dof))


def tree_search(
    query: MotionQuery, config: SearchConfig, rng: np.random.Generator
) -> Float[np.ndarray, "m dof"] | None:
    """Return a free path from the start to one of the goals, or None after config.max_iterations samples.

    Start and goals must be free. The goals are tried in their order: the first one has the tree to itself, and each
    further one joins when the tree has grown to twice as many nodes as goals. Every draw comes from rng.
    """
    space, goals = query.space, kernel_array(query.goals)
    samples = rng.uniform(space.lower, space.upper, (config.max_iterations, len(query.start)))
    # Per sample one node for growing towards it, and one per range_rad for growing towards the other tree.
    way = int(np.linalg.norm(space.upper - space.lower) / config.range_rad) + 2
    path = _connect(
        kernel_array(query.start),
        goals,
        samples,
        config.range_rad,
        len(goals) + 1 + config.max_iterations * (way + 1),
        space.scene,
    )
    return path if len(path) else None


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
