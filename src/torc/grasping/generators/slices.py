"""Propose slices: cut the cloud for every approach and closing axis, and reach into each slice to some depths."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.grasping.axes import approach_directions, grasp_frames, normal_clusters
from torc.grasping.cells import along, axes_of
from torc.grasping.generators.common import (
    NO_CANDIDATES,
    GeneratorInput,
    RawCandidates,
    drawn,
    lowest_tip_z,
    make_rotation,
)
from torc.grasping.hand import HandGeometry

_BIN_M = 0.003
_CAPACITY = 8000


class _Rules(NamedTuple):
    """Hand and settings for the kernels; see CandidateConfig and GeneratorInput."""

    hand: HandGeometry
    depths_m: Float[np.ndarray, "d"]
    support_z_m: float
    tip_margin_m: float
    spread_m: float
    slice_m: float
    min_depth_m: float
    gap_m: float
    min_points: int


def propose_slices(given: GeneratorInput, rng: np.random.Generator) -> RawCandidates:
    """Return grasps from slices; an object that is too wide for the gripper is grasped by its parts, one by one."""
    cloud, config = given.cloud, given.config
    if cloud.visible < given.min_points:
        return NO_CANDIDATES
    approaches = approach_directions(given.forward, config)
    clusters = normal_clusters(cloud.normals[: cloud.visible], config.normal_clusters)
    closings, turned, first = grasp_frames(
        approaches, cloud.seen, clusters, cloud.completion.view, given.forward, config
    )
    frames = _drawn_frames(len(closings), first, config.max_frames, rng)
    out = np.empty((_CAPACITY, 3, 3)), np.empty((_CAPACITY, 3)), np.empty(_CAPACITY)
    rules = _Rules(
        hand=given.hand,
        depths_m=np.sort(np.array(config.depths_m)),
        support_z_m=float(given.support_z_m),
        tip_margin_m=float(given.tip_margin_m),
        spread_m=float(config.spread_m),
        slice_m=float(config.slice_m),
        min_depth_m=float(config.min_depth_m),
        gap_m=float(config.gap_m),
        min_points=given.min_points,
    )
    n = _slices(
        cloud.points,
        cloud.visible,
        cloud.felt,
        closings[frames],
        turned[frames],
        rng.random(len(frames)),
        config.slices_per_frame,
        rules,
        out,
    )
    return drawn(RawCandidates(*(a[:n] for a in out)), config.max_raw, rng)


def _drawn_frames(total: int, first: int, limit: int, rng: np.random.Generator) -> np.ndarray:
    """Return indices of frames: all of the first ones (straight down), the rest drawn evenly."""
    rest = total - first
    drawn_rest = np.sort(rng.permutation(rest)[: max(0, limit - first)])
    return np.concatenate([np.arange(first), first + drawn_rest])


@njit(cache=True, nogil=True)
def _slices(points, visible, felt, closings, approaches, phases, most_slices, rules, out):
    """Write candidates to `out` (rotations, tips, widths); return how many."""
    R, total = np.empty((3, 3)), len(points)
    x, y, z, strip = np.empty(total), np.empty(total), np.empty(total), np.empty((total, 4))
    n = 0
    for f in range(len(closings)):
        make_rotation(closings[f], approaches[f], R)
        (ex, ey, ez), low, high = axes_of(R), 1e9, -1e9
        for i in range(total):
            px, py, pz = points[i, 0], points[i, 1], points[i, 2]
            x[i], y[i], z[i] = along(ex, px, py, pz), along(ey, px, py, pz), along(ez, px, py, pz)
            if i < visible:
                low, high = min(low, y[i]), max(high, y[i])
        slices = max(1, int(np.ceil((high - low) / rules.slice_m)))
        taken = min(slices, most_slices)
        for s in range(taken):
            middle = low + (high - low) * (int((s + phases[f]) * slices / taken) + 0.5) / slices
            count = 0
            for i in range(total):
                side = abs(y[i] - middle)
                if side < rules.hand.finger_y:
                    strip[count, 0], strip[count, 1] = x[i], z[i]
                    strip[count, 2] = 1.0 if i < visible else (-1.0 if i < visible + felt else 0.0)
                    strip[count, 3] = 1.0 if side < rules.hand.pad_y else 0.0
                    count += 1
            n = _reach_into(strip[:count], middle, R, rules, out, n)
    return n


@njit(cache=True)
def _reach_into(strip, y, R, rules, out, n):
    """Write the candidates of one slice at every depth: centred on all points behind the fingertips, or on each part.

    Columns of `strip`: x, z, 1 if seen and -1 if felt, whether within the pads.
    """
    top, left, right = 1e9, 1e9, -1e9
    for i in range(len(strip)):
        left, right = min(left, strip[i, 0]), max(right, strip[i, 0])
        if strip[i, 2] > 0.0:
            top = min(top, strip[i, 1])
    floor = lowest_tip_z(R, rules.hand, rules.support_z_m, rules.tip_margin_m)
    last_z = -1e9
    for depth in rules.depths_m:
        z = top + depth
        below = floor - (0.5 * (left + right) * R[2, 0] + y * R[2, 1] + z * R[2, 2])
        if below > 0.0:
            if R[2, 2] > -0.05:
                break
            z += below / R[2, 2]
        if z < top + rules.min_depth_m or z < last_z + 0.004:
            break
        last_z = z
        low, high, count, _ = _within(strip, z, -1e9, 1e9, rules.hand.pad_z)
        if high < low:
            continue
        if high - low + rules.spread_m > rules.hand.max_width_m:
            n = _parts(strip, low, high, y, z, R, rules, out, n)
        elif count >= rules.min_points:
            n = _write(low, high, y, z, R, out, n)
    return n


@njit(cache=True)
def _within(strip, z, x_low, x_high, pad_z):
    """Measure the points behind the fingertips in a range of x.

    Returns their least and largest x, how many seen ones are between the pads, and how many were felt.
    """
    low, high, count, felt = 1e9, -1e9, 0, 0
    for i in range(len(strip)):
        x = strip[i, 0]
        if strip[i, 1] > z or x < x_low or x > x_high:
            continue
        low, high = min(low, x), max(high, x)
        felt += strip[i, 2] < 0.0
        if strip[i, 2] * strip[i, 3] > 0.0 and strip[i, 1] > z - pad_z:
            count += 1
    return low, high, count, felt


@njit(cache=True)
def _parts(strip, low, high, y, z, R, rules, out, n):
    """Write one candidate per part of the slice that is separated from the others by a gap and fits.

    Not where something was felt: nobody saw a gap there.
    """
    bins = int((high - low) / _BIN_M) + 1
    filled = np.zeros(bins + 1, dtype=np.bool_)
    for i in range(len(strip)):
        if strip[i, 1] <= z:
            filled[int((strip[i, 0] - low) / _BIN_M)] = True
    gap = int(np.ceil(rules.gap_m / _BIN_M))
    start = last = 0
    # The extra bin at the end closes the last part.
    for b in range(1, bins + 1):
        if b < bins and not filled[b]:
            continue
        if b == bins or b - last > gap:
            first_x, last_x = low + start * _BIN_M - 1e-9, low + (last + 1) * _BIN_M + 1e-9
            x_low, x_high, count, felt = _within(strip, z, first_x, last_x, rules.hand.pad_z)
            fits = x_high - x_low + rules.spread_m <= rules.hand.max_width_m
            if fits and count >= rules.min_points and felt == 0:
                n = _write(x_low, x_high, y, z, R, out, n)
            start = b
        last = b
    return n


@njit(cache=True)
def _write(low, high, y, z, R, out, n):
    """Write candidate n if there is room for it; return the new number."""
    Rs, tips, widths = out
    if n == len(widths):
        return n
    Rs[n] = R
    tips[n] = 0.5 * (low + high) * R[:, 0] + y * R[:, 1] + z * R[:, 2]
    widths[n] = high - low
    return n + 1
