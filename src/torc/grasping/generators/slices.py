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
    # Coordinate by coordinate: vector instructions.
    px, py, pz = points[:, 0].copy(), points[:, 1].copy(), points[:, 2].copy()
    x, y, z, kind = np.empty(total), np.empty(total), np.empty(total), np.zeros(total)
    kind[:visible], kind[visible : visible + felt] = 1.0, -1.0
    xs, zs, seen, within_pads = np.empty(total), np.empty(total), np.empty(total), np.empty(total)
    n = 0
    for f in range(len(closings)):
        make_rotation(closings[f], approaches[f], R)
        ex, ey, ez = axes_of(R)
        for i in range(total):
            x[i], y[i], z[i] = (
                along(ex, px[i], py[i], pz[i]),
                along(ey, px[i], py[i], pz[i]),
                along(ez, px[i], py[i], pz[i]),
            )
        low, high = span(y[:visible])
        slices = max(1, int(np.ceil((high - low) / rules.slice_m)))
        taken = min(slices, most_slices)
        for s in range(taken):
            middle = low + (high - low) * (int((s + phases[f]) * slices / taken) + 0.5) / slices
            count = 0
            for i in range(total):
                side = abs(y[i] - middle)
                if side < rules.hand.finger_y:
                    xs[count], zs[count], seen[count] = x[i], z[i], kind[i]
                    within_pads[count] = 1.0 if side < rules.hand.pad_y else 0.0
                    count += 1
            some = xs[:count], zs[:count], seen[:count], within_pads[:count]
            n = _reach_into(some, middle, R, rules, out, n)
    return n


@njit(cache=True)
def _reach_into(strip, y, R, rules, out, n):
    """Write the candidates of one slice at every depth: centred on all points behind the fingertips, or on each part.

    `strip`: x and z of its points, 1 for seen and -1 for felt ones, 1 for those within the pads.
    """
    x, below, seen, _ = strip
    left, right = span(x)
    top = 1e9
    for i in range(len(x)):
        top = min(top, below[i] if seen[i] > 0.0 else 1e9)
    floor = lowest_tip_z(R, rules.hand, rules.support_z_m, rules.tip_margin_m)
    last_z = -1e9
    for depth in rules.depths_m:
        z = top + depth
        missing = floor - (0.5 * (left + right) * R[2, 0] + y * R[2, 1] + z * R[2, 2])
        if missing > 0.0:
            if R[2, 2] > -0.05:
                break
            z += missing / R[2, 2]
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


@njit(cache=True, fastmath={"nnan", "nsz"})
def span(values):
    """Return the least and the greatest value; 1e9 and -1e9 for none."""
    low, high = 1e9, -1e9
    for v in values:
        low, high = min(low, v), max(high, v)
    return low, high


@njit(cache=True, fastmath={"nnan", "nsz"})
def _within(strip, z, x_low, x_high, pad_z):
    """Measure the points behind the fingertips in a range of x.

    Returns their least and largest x, how many seen ones are between the pads, and how many were felt.
    """
    xs, zs, seen, within_pads = strip
    low, high, count, felt = 1e9, -1e9, 0, 0
    for i in range(len(xs)):
        x = xs[i]
        inside = (zs[i] <= z) & (x >= x_low) & (x <= x_high)
        low, high = min(low, x if inside else 1e9), max(high, x if inside else -1e9)
        felt += inside & (seen[i] < 0.0)
        count += inside & (seen[i] * within_pads[i] > 0.0) & (zs[i] > z - pad_z)
    return low, high, count, felt


@njit(cache=True)
def _parts(strip, low, high, y, z, R, rules, out, n):
    """Write one candidate per part of the slice that is separated from the others by a gap and fits.

    Not where something was felt: nobody saw a gap there.
    """
    bins = int((high - low) / _BIN_M) + 1
    filled = np.zeros(bins + 1, dtype=np.bool_)
    x, below, _, _ = strip
    for i in range(len(x)):
        if below[i] <= z:
            filled[int((x[i] - low) / _BIN_M)] = True
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
