"""Measure how neighbouring masks meet, in compiled passes over label and depth images."""

import numpy as np
from jaxtyping import Float, Float32, Int16, Int32, Int64, UInt64
from numba import njit

_ZERO, _ONE = np.uint64(0), np.uint64(1)


@njit(cache=True)
def nearby_labels(
    label: Int16[np.ndarray, "h w"], known: np.uint64, offsets: Int64[np.ndarray, "m 2"]
) -> UInt64[np.ndarray, "h w"]:
    """Return, per pixel, the known labels within the disk of offsets, as bits: the masks that reach it once dilated.

    Only pixels at the edge of a mask are spread. That suffices for every pixel outside the mask: the mask's nearest
    pixel is on its edge.
    """
    height, width = label.shape
    near = np.zeros((height, width), np.uint64)
    for row in range(height):
        for col in range(width):
            k = label[row, col]
            if k < 0 or (known >> np.uint64(k)) & _ONE == _ZERO:
                continue
            edge = (
                (row > 0 and label[row - 1, col] != k)
                or (col > 0 and label[row, col - 1] != k)
                or (row + 1 < height and label[row + 1, col] != k)
                or (col + 1 < width and label[row, col + 1] != k)
            )
            if edge:
                bit = _ONE << np.uint64(k)
                for m in range(len(offsets)):
                    r, c = row + offsets[m, 0], col + offsets[m, 1]
                    if 0 <= r < height and 0 <= c < width:
                        near[r, c] |= bit
    return near


@njit(cache=True)
def _rests_under(
    row: int,
    col: int,
    other: int,
    label: np.ndarray,
    index: np.ndarray,
    points: np.ndarray,
    closeness_m: float,
    focal_px: float,
    depth_m: float,
) -> bool:
    """Check whether the closest point of the other object is within the distance and above this pixel's point."""
    height, width = label.shape
    p = points[index[row, col]]
    reach = int(np.ceil(closeness_m * focal_px / depth_m)) + 1
    best, best_z = closeness_m * closeness_m, p[2]
    for r in range(max(0, row - reach), min(height, row + reach + 1)):
        for c in range(max(0, col - reach), min(width, col + reach + 1)):
            i = index[r, c]
            if i < 0 or label[r, c] != other:
                continue
            q = points[i]
            d2 = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
            if d2 < best:
                best, best_z = d2, q[2]
    return best_z > p[2]


@njit(cache=True)
def measure_boundaries(
    label: Int16[np.ndarray, "h w"],
    depth_m: Float32[np.ndarray, "h w"],
    near: UInt64[np.ndarray, "h w"],
    index: Int32[np.ndarray, "h w"],
    points: Float32[np.ndarray, "n 3"],
    normals: Float32[np.ndarray, "n 3"],
    known: np.uint64,
    focal_px: float,
    closeness_m: float,
    closeness_samples: float,
    upright_cos: float,
) -> tuple[Int64[np.ndarray, "k k"], Float[np.ndarray, "k k"], Int64[np.ndarray, "k k"]]:
    """Measure, for labels a and b, the pixels of a with a depth that lie within the disk of b.

    Returns:
        Their number, the sum of their depths, and how many of them support "a is below b".
    """
    height, width = label.shape
    count = np.zeros((64, 64), np.int64)
    depth_sum = np.zeros((64, 64))
    support = np.zeros((64, 64), np.int64)
    for row in range(height):
        for col in range(width):
            if near[row, col] == _ZERO or label[row, col] < 0:
                continue
            a = label[row, col]
            own = _ONE << np.uint64(a)
            others = near[row, col] & ~own
            d = depth_m[row, col]
            if (known & own) == _ZERO or others == _ZERO or not d > 0:
                continue
            i = index[row, col]
            up = i >= 0 and normals[i, 2] > upright_cos
            close = max(closeness_m, closeness_samples * d / focal_px)
            for b in range(64):
                if (others >> np.uint64(b)) & _ONE == _ZERO:
                    continue
                count[a, b] += 1
                depth_sum[a, b] += d
                if up and _rests_under(row, col, b, label, index, points, close, focal_px, d):
                    support[a, b] += 1
    return count, depth_sum, support
