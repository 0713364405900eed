"""Slices: for every approach and closing axis, cut the cloud into slices and reach into each to some depths."""

import numpy as np
from numba import njit

from torc.grasping.axes import approach_directions, closing_axes, normal_clusters
from torc.grasping.generators.common import (
    GeneratorInput,
    RawCandidates,
    drawn,
    lowest_tip_z,
    make_rotation,
    no_candidates,
)

_BIN_M = 0.002
_CAPACITY = 12000


def propose_slices(given: GeneratorInput, rng: np.random.Generator) -> RawCandidates:
    """Grasps from slices; objects too wide for the gripper are scanned for rims."""
    cloud, config = given.cloud, given.config
    seen = cloud.points[: cloud.visible]
    if len(seen) < given.min_points:
        return no_candidates()
    approaches = approach_directions(given.forward, config)
    clusters = normal_clusters(cloud.normals[: cloud.visible], config.normal_clusters)
    axes, counts = closing_axes(approaches, seen, clusters, cloud.completion.view, config.closing_merge_rad)
    frames = _drawn_frames(counts, config.max_frames, rng)
    phases = rng.random(len(frames))
    Rs, tips, widths = np.empty((_CAPACITY, 3, 3)), np.empty((_CAPACITY, 3)), np.empty(_CAPACITY)
    limits = np.array(
        [given.support_z_m, given.tip_margin_m, config.spread_m, config.slice_m, config.min_depth_m, config.scan_m]
    )
    n = _slices(
        cloud.points,
        cloud.visible,
        approaches,
        axes,
        frames,
        phases,
        config.slices_per_frame,
        np.array(config.depths_m),
        limits,
        given.min_points,
        given.hand.sizes,
        Rs,
        tips,
        widths,
    )
    return drawn(RawCandidates(Rs[:n], tips[:n], widths[:n]), config.max_raw, rng)


def _drawn_frames(counts: np.ndarray, limit: int, rng: np.random.Generator) -> np.ndarray:
    """(approach, closing axis) pairs: all of the first approach, the rest drawn evenly."""
    frames = np.array([(a, c) for a, n in enumerate(counts) for c in range(n)], dtype=np.int64).reshape(-1, 2)
    first = int(counts[0])
    rest = max(0, limit - first)
    if len(frames) - first <= rest:
        return frames
    return np.concatenate([frames[:first], frames[first + np.sort(rng.permutation(len(frames) - first)[:rest])]])


@njit(cache=True)
def _slices(
    points: np.ndarray,
    visible: int,
    approaches: np.ndarray,
    axes: np.ndarray,
    frames: np.ndarray,
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
    """Write candidates; returns how many. `limits`: support, tip margin, spread, slice, least depth, scan step."""
    R = np.empty((3, 3))
    order = np.empty(len(points), dtype=np.int64)
    n = 0
    for f in range(len(frames)):
        a, c = frames[f]
        make_rotation(axes[a, c], approaches[a], R)
        local = points @ R
        low, high = local[:visible, 1].min(), local[:visible, 1].max()
        bins = int((high - low) / _BIN_M) + 1
        starts = _sort_into_bins(local[:, 1], low, bins, order)
        slices = max(1, int(np.ceil((high - low) / limits[3])))
        taken = min(slices, most_slices)
        for s in range(taken):
            y = low + (high - low) * (int((s + phases[f]) * slices / taken) + 0.5) / slices
            first = max(0, int((y - sizes[3] - low) / _BIN_M))
            last = min(bins - 1, int((y + sizes[3] - low) / _BIN_M))
            inside = order[starts[first] : starts[last + 1]]
            n = _reach_into(local, visible, inside, y, R, depths, limits, min_points, sizes, Rs, tips, widths, n)
    return n


@njit(cache=True)
def _sort_into_bins(y: np.ndarray, low: float, bins: int, order: np.ndarray) -> np.ndarray:
    """Counting sort: fills `order`, returns where each bin starts (with the end). Points outside go to the ends."""
    starts = np.zeros(bins + 1, dtype=np.int64)
    index = np.empty(len(y), dtype=np.int64)
    for i in range(len(y)):
        b = int((y[i] - low) / _BIN_M)
        index[i] = min(max(b, 0), bins - 1)
        starts[index[i] + 1] += 1
    for b in range(bins):
        starts[b + 1] += starts[b]
    cursor = starts.copy()
    for i in range(len(y)):
        order[cursor[index[i]]] = i
        cursor[index[i]] += 1
    return starts


@njit(cache=True)
def _reach_into(
    local: np.ndarray,
    visible: int,
    inside: np.ndarray,
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
    """Candidates of one slice: every depth, centred if it fits, else scanned across."""
    top = 1e9
    for i in inside:
        if i < visible and abs(local[i, 1] - y) < sizes[3]:
            top = min(top, local[i, 2])
    lowest = lowest_tip_z(R, sizes, limits[0], limits[1])
    last_z = -1e9
    for depth in depths:
        z = top + depth
        low, high = _extent(local, inside, y, z, -1e9, 1e9, sizes)
        if high < low:
            continue
        below = lowest - (0.5 * (low + high) * R[2, 0] + y * R[2, 1] + z * R[2, 2])
        if below > 0.0:
            if R[2, 2] > -0.05:
                continue
            z -= below / -R[2, 2]
        if z < top + limits[4] or z < last_z + 0.004:
            continue
        last_z = z
        low, high = _extent(local, inside, y, z, -1e9, 1e9, sizes)
        if high < low:
            continue
        if high - low + limits[2] <= sizes[0]:
            n = _emit(local, visible, inside, low, high, y, z, R, min_points, sizes, Rs, tips, widths, n)
            continue
        x = low
        while x <= high:
            l2, h2 = _extent(local, inside, y, z, x - 0.5 * sizes[0], x + 0.5 * sizes[0], sizes)
            if h2 > l2 and h2 - l2 + limits[2] <= sizes[0]:
                n = _emit(local, visible, inside, l2, h2, y, z, R, min_points, sizes, Rs, tips, widths, n)
            x += limits[5]
    return n


@njit(cache=True)
def _extent(
    local: np.ndarray, inside: np.ndarray, y: float, z: float, x_low: float, x_high: float, sizes: np.ndarray
) -> tuple[float, float]:
    """Least and greatest x of the slice's points behind the fingertips and between x_low and x_high."""
    low, high = 1e9, -1e9
    for i in inside:
        x = local[i, 0]
        if local[i, 2] <= z and x >= x_low and x <= x_high and abs(local[i, 1] - y) < sizes[3]:
            low, high = min(low, x), max(high, x)
    return low, high


@njit(cache=True)
def _emit(
    local: np.ndarray,
    visible: int,
    inside: np.ndarray,
    low: float,
    high: float,
    y: float,
    z: float,
    R: np.ndarray,
    min_points: int,
    sizes: np.ndarray,
    Rs: np.ndarray,
    tips: np.ndarray,
    widths: np.ndarray,
    n: int,
) -> int:
    """Write one candidate if enough seen points lie between its pads and there is room."""
    count = 0
    for i in inside:
        if (
            i < visible
            and abs(local[i, 1] - y) < sizes[1]
            and local[i, 2] <= z
            and local[i, 2] > z - sizes[2]
            and local[i, 0] >= low
            and local[i, 0] <= high
        ):
            count += 1
    if count < min_points or n >= len(widths):
        return n
    x = 0.5 * (low + high)
    Rs[n] = R
    tips[n] = x * R[:, 0] + y * R[:, 1] + z * R[:, 2]
    widths[n] = high - low
    return n + 1
