"""Slices: for every approach and closing axis, cut the cloud into slices and reach into each to some depths."""

import numpy as np
from numba import njit

from torc.grasping.axes import approach_directions, grasp_frames, normal_clusters
from torc.grasping.generators.common import (
    GeneratorInput,
    RawCandidates,
    drawn,
    lowest_tip_z,
    make_rotation,
    no_candidates,
)
from torc.grasping.hand import FINGER_Y, OPEN, PAD_Y, PAD_Z

_BIN_M = 0.003
_CAPACITY = 8000


def propose_slices(given: GeneratorInput, rng: np.random.Generator) -> RawCandidates:
    """Grasps from slices; where an object is too wide for the gripper, its parts are grasped one by one."""
    cloud, config = given.cloud, given.config
    if cloud.visible < given.min_points:
        return no_candidates()
    approaches = approach_directions(given.forward, config)
    clusters = normal_clusters(cloud.normals[: cloud.visible], config.normal_clusters)
    closings, turned, first = grasp_frames(
        approaches, cloud.seen, clusters, cloud.completion.view, given.forward, config
    )
    frames = _drawn_frames(len(closings), first, config.max_frames, rng)
    Rs, tips, widths = np.empty((_CAPACITY, 3, 3)), np.empty((_CAPACITY, 3)), np.empty(_CAPACITY)
    n = _slices(
        cloud.points,
        cloud.visible,
        cloud.felt,
        closings[frames],
        turned[frames],
        rng.random(len(frames)),
        config.slices_per_frame,
        np.sort(np.array(config.depths_m)),
        np.array(
            [
                given.support_z_m,
                given.tip_margin_m,
                config.spread_m,
                config.slice_m,
                config.min_depth_m,
                config.gap_m,
            ]
        ),
        given.min_points,
        given.hand.sizes,
        Rs,
        tips,
        widths,
    )
    return drawn(RawCandidates(Rs[:n], tips[:n], widths[:n]), config.max_raw, rng)


def _drawn_frames(total: int, first: int, limit: int, rng: np.random.Generator) -> np.ndarray:
    """Indices of frames: the first ones (straight down) all, the rest drawn evenly."""
    rest = total - first
    drawn_rest = np.sort(rng.permutation(rest)[: max(0, limit - first)])
    return np.concatenate([np.arange(first), first + drawn_rest])


@njit(cache=True)
def _slices(
    points: np.ndarray,
    visible: int,
    felt: int,
    closings: np.ndarray,
    approaches: np.ndarray,
    phases: np.ndarray,
    most_slices: int,
    depths: np.ndarray,
    limits: np.ndarray,
    min_points: int,
    sizes: np.ndarray,
    Rs: np.ndarray,
    tips: np.ndarray,
    widths: np.ndarray,
) -> int:
    """Write candidates; returns how many. `limits`: support, tip margin, spread, slice, least depth, gap."""
    R = np.empty((3, 3))
    local, strip = np.empty((len(points), 3)), np.empty((len(points), 4))
    n = 0
    for f in range(len(closings)):
        make_rotation(closings[f], approaches[f], R)
        low, high = 1e9, -1e9
        for i in range(len(points)):
            for a in range(3):
                local[i, a] = R[0, a] * points[i, 0] + R[1, a] * points[i, 1] + R[2, a] * points[i, 2]
            if i < visible:
                low, high = min(low, local[i, 1]), max(high, local[i, 1])
        slices = max(1, int(np.ceil((high - low) / limits[3])))
        taken = min(slices, most_slices)
        for s in range(taken):
            y = low + (high - low) * (int((s + phases[f]) * slices / taken) + 0.5) / slices
            count = 0
            for i in range(len(points)):
                side = abs(local[i, 1] - y)
                if side < sizes[FINGER_Y]:
                    strip[count, 0], strip[count, 1] = local[i, 0], local[i, 2]
                    strip[count, 2] = 1.0 if i < visible else (-1.0 if i < visible + felt else 0.0)
                    strip[count, 3] = 1.0 if side < sizes[PAD_Y] else 0.0
                    count += 1
            n = _reach_into(strip[:count], y, R, depths, limits, min_points, sizes, Rs, tips, widths, n)
    return n


@njit(cache=True)
def _reach_into(
    strip: np.ndarray,
    y: float,
    R: np.ndarray,
    depths: np.ndarray,
    limits: np.ndarray,
    min_points: int,
    sizes: np.ndarray,
    Rs: np.ndarray,
    tips: np.ndarray,
    widths: np.ndarray,
    n: int,
) -> int:
    """Candidates of one slice at every depth: centred on all that is behind the fingertips if that fits, else on
    each of its parts. Columns of `strip`: x, z, 1 if seen and -1 if felt, whether within the pads."""
    top, left, right = 1e9, 1e9, -1e9
    for i in range(len(strip)):
        left, right = min(left, strip[i, 0]), max(right, strip[i, 0])
        if strip[i, 2] > 0.0:
            top = min(top, strip[i, 1])
    floor = lowest_tip_z(R, sizes, limits[0], limits[1])
    last_z = -1e9
    for depth in depths:
        z = top + depth
        below = floor - (0.5 * (left + right) * R[2, 0] + y * R[2, 1] + z * R[2, 2])
        if below > 0.0:
            if R[2, 2] > -0.05:
                break
            z += below / R[2, 2]
        if z < top + limits[4] or z < last_z + 0.004:
            break
        last_z = z
        low, high, count = _within(strip, z, -1e9, 1e9, sizes)
        if high < low:
            continue
        if high - low + limits[2] <= sizes[OPEN]:
            if count >= min_points and n < len(widths):
                _write(low, high, y, z, R, Rs, tips, widths, n)
                n += 1
        else:
            n = _parts(strip, low, high, y, z, R, limits, min_points, sizes, Rs, tips, widths, n)
    return n


@njit(cache=True)
def _within(
    strip: np.ndarray, z: float, x_low: float, x_high: float, sizes: np.ndarray
) -> tuple[float, float, int]:
    """Extent along x of the points behind the fingertips and in a range of x, and the seen ones between the pads."""
    low, high, count = 1e9, -1e9, 0
    for i in range(len(strip)):
        x = strip[i, 0]
        if strip[i, 1] > z or x < x_low or x > x_high:
            continue
        low, high = min(low, x), max(high, x)
        if strip[i, 2] * strip[i, 3] > 0.0 and strip[i, 1] > z - sizes[PAD_Z]:
            count += 1
    return low, high, count


@njit(cache=True)
def _parts(
    strip: np.ndarray,
    low: float,
    high: float,
    y: float,
    z: float,
    R: np.ndarray,
    limits: np.ndarray,
    min_points: int,
    sizes: np.ndarray,
    Rs: np.ndarray,
    tips: np.ndarray,
    widths: np.ndarray,
    n: int,
) -> int:
    """One candidate per part of the slice that is separated from the others by a gap and fits.

    Not where something was felt: nobody saw a gap there.
    """
    bins = int((high - low) / _BIN_M) + 1
    filled = np.zeros(bins + 1, dtype=np.bool_)
    for i in range(len(strip)):
        if strip[i, 1] <= z:
            filled[int((strip[i, 0] - low) / _BIN_M)] = True
    gap = int(np.ceil(limits[5] / _BIN_M))
    start = last = 0
    # The extra bin at the end closes the last part.
    for b in range(1, bins + 1):
        if b < bins and not filled[b]:
            continue
        if b == bins or b - last > gap:
            x_low, x_high, count = _within(
                strip, z, low + start * _BIN_M - 1e-9, low + (last + 1) * _BIN_M + 1e-9, sizes
            )
            fits = x_high - x_low + limits[2] <= sizes[OPEN] and count >= min_points
            if fits and n < len(widths) and _felt_within(strip, z, x_low, x_high) == 0:
                _write(x_low, x_high, y, z, R, Rs, tips, widths, n)
                n += 1
            start = b
        last = b
    return n


@njit(cache=True)
def _felt_within(strip: np.ndarray, z: float, x_low: float, x_high: float) -> int:
    """How many felt points lie behind the fingertips in a range of x."""
    count = 0
    for i in range(len(strip)):
        if strip[i, 2] < 0.0 and strip[i, 1] <= z and x_low <= strip[i, 0] <= x_high:
            count += 1
    return count


@njit(cache=True)
def _write(
    low: float,
    high: float,
    y: float,
    z: float,
    R: np.ndarray,
    Rs: np.ndarray,
    tips: np.ndarray,
    widths: np.ndarray,
    n: int,
) -> None:
    Rs[n] = R
    tips[n] = 0.5 * (low + high) * R[:, 0] + y * R[:, 1] + z * R[:, 2]
    widths[n] = high - low
