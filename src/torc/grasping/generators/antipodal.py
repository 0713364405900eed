"""Propose antipodal pairs: a seen point and a seen or guessed one whose normals oppose each other along their line."""

import numpy as np
from numba import njit

from torc.grasping.axes import approach_directions, in_cone
from torc.grasping.generators.common import (
    NO_CANDIDATES,
    GeneratorInput,
    RawCandidates,
    drawn,
    make_rotation,
    settled,
)

_PAIR_COS = float(np.cos(np.deg2rad(25.0)))
_MIN_GAP_M = 0.004
_MAX_SOURCES = 100
_CONTACT_DEPTHS_M = (0.008, 0.018)
_MAX_TURN_COS = float(np.cos(np.deg2rad(25.0)))


def propose_antipodal(given: GeneratorInput, rng: np.random.Generator) -> RawCandidates:
    """Return grasps that close along antipodal pairs, approached from every perpendicular direction of the set."""
    cloud, config = given.cloud, given.config
    if cloud.visible < given.min_points:
        return NO_CANDIDATES
    sources = rng.permutation(cloud.visible)[:_MAX_SOURCES]
    start = rng.integers(len(cloud.points), size=len(sources))
    pairs = _pairs(cloud.points, cloud.normals, sources, start, given.hand.max_width_m - config.spread_m)
    approaches = approach_directions(given.forward, config)
    order = rng.permuted(np.tile(np.arange(len(approaches)), (len(pairs), 1)), axis=1)
    Rs, tips = _approach_pairs(
        cloud.points, pairs, approaches, order, given.forward, float(np.cos(config.max_yaw_rad))
    )
    raw = drawn(RawCandidates(Rs, tips, np.zeros(len(tips))), config.max_raw, rng)
    return settled(raw, given)


@njit(cache=True, nogil=True, error_model="numpy")
def _pairs(points, normals, sources, start, max_gap_m):
    """Return, for each source, the best-opposed partner (index pairs); sources without one are left out.

    Both normals must lie within 25 degrees of the connecting line. The search starts at a random partner, so that ties
    (on a flat face) are not always resolved to the first.
    """
    out = np.empty((len(sources), 2), dtype=np.int64)
    n, total = 0, len(points)
    # Coordinate by coordinate, and without branches: vector instructions.
    px, py, pz = points[:, 0].copy(), points[:, 1].copy(), points[:, 2].copy()
    nx, ny, nz = normals[:, 0].copy(), normals[:, 1].copy(), normals[:, 2].copy()
    opposed = np.empty(total)
    for s in range(len(sources)):
        i = sources[s]
        x, y, z, mx, my, mz = px[i], py[i], pz[i], nx[i], ny[i], nz[i]
        for j in range(total):
            dx, dy, dz = px[j] - x, py[j] - y, pz[j] - z
            gap = np.sqrt(dx * dx + dy * dy + dz * dz)
            a, b = -(mx * dx + my * dy + mz * dz) / gap, (nx[j] * dx + ny[j] * dy + nz[j] * dz) / gap
            fits = (gap >= _MIN_GAP_M) & (gap <= max_gap_m) & (a >= _PAIR_COS) & (b >= _PAIR_COS)
            opposed[j] = a + b if fits else 0.0
        best, partner = 2.0 * _PAIR_COS, -1
        for k in range(total):
            j = k + start[s] if k + start[s] < total else k + start[s] - total
            if opposed[j] > best + 1e-3:
                best, partner = opposed[j], j
        if partner >= 0:
            out[n, 0], out[n, 1] = i, partner
            n += 1
    return out[:n]


@njit(cache=True, nogil=True)
def _approach_pairs(points, pairs, approaches, order, forward, yaw_cos):
    """Return rotations and TCPs: up to three approaches per pair, each at two depths of the contact on the pad."""
    per_pair = 3
    most = len(pairs) * per_pair * len(_CONTACT_DEPTHS_M)
    Rs, tips = np.empty((most, 3, 3)), np.empty((most, 3))
    n = 0
    for p in range(len(pairs)):
        closing = points[pairs[p, 1]] - points[pairs[p, 0]]
        closing /= np.sqrt(np.sum(closing**2))
        middle = 0.5 * (points[pairs[p, 0]] + points[pairs[p, 1]])
        found = 0
        for k in range(len(approaches)):
            wanted = approaches[order[p, k]]
            across = wanted - np.sum(wanted * closing) * closing
            norm = np.sqrt(np.sum(across**2))
            if norm < _MAX_TURN_COS:
                continue
            across /= norm
            if not in_cone(across, forward, yaw_cos):
                continue
            for depth in _CONTACT_DEPTHS_M:
                make_rotation(closing, across, Rs[n])
                tips[n] = middle + depth * across
                n += 1
            found += 1
            if found == per_pair:
                break
    return Rs[:n], tips[:n]
