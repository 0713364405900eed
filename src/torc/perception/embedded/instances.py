"""Turn the network's output on pixels and pairs of pixels into one mask per object.

Pixels of an object fall into small basins, each around a place that is deep inside something. Basins are joined in the
order of the mean probability that pairs of pixels across them, at all distances, show one object, while that is more
likely than not (average linkage, as in Bailoni et al. 2022, GASP). So an object cut in two by something in front can be
joined across the gap, and one weak spot in a boundary joins nothing.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Int16, Int32
from numba import njit

from torc.errors import InputError
from torc.geometry.transforms import kernel_array
from torc.perception.image_kernels import count_labels, looked_up

OFFSETS = tuple(
    offset
    for near, slant in ((2, 0), (6, 5), (16, 12), (40, 28))
    for offset in ((0, near), (near, 0), *(((slant, slant), (slant, -slant)) if slant else ()))
)
"""Rows and columns from a pixel to its partner, in the order of the network's outputs."""


_WALL = 0.5
"""A basin does not reach over pairs of pixels that show one object with a lower probability."""


@dataclass(frozen=True)
class InstanceConfig:
    """How masks are made.

    Attributes:
        object_p: pixels that show an object with this probability belong to one.
        same_p: basins are joined down to this mean probability.
        min_pixels: smaller masks are dropped; pixels are about 2 mm wide.
        min_pairs: basins that fewer pairs of pixels connect are not joined directly.
    """

    object_p: float = 0.5
    same_p: float = 0.55
    min_pixels: int = 30
    min_pairs: int = 4

    def __post_init__(self) -> None:
        if not (0 < self.object_p < 1 and 0 < self.same_p < 1):
            raise InputError("InstanceConfig: object_p and same_p are probabilities between 0 and 1.")


@dataclass(frozen=True)
class Instances:
    """Masks of one picture.

    Attributes:
        label: number of the mask per pixel, from 0 on, largest first; -1 for none.
        sureness: per mask, how surely it is one object: the mean probability of pairs within it to show one object,
            times that of pairs across its rim not to.
    """

    label: Int16[np.ndarray, "h w"]
    sureness: Float32[np.ndarray, "n"]


def find_instances(
    object_p: Float32[np.ndarray, "h w"],
    same_p: Float32[np.ndarray, "k h w"],
    config: InstanceConfig | None = None,
) -> Instances:
    """Return masks from the probabilities that a pixel shows an object, and that its partners show that object."""
    config = InstanceConfig() if config is None else config
    mask = object_p > config.object_p
    basins, count = _basins(mask, same_p)
    if count == 0:
        return Instances(np.full(mask.shape, -1, np.int16), np.zeros(0, np.float32))
    offsets = np.array(OFFSETS)
    same = kernel_array(same_p, np.float32)
    sums, pairs = _add_up(basins, same, offsets, count)
    owner = _join(sums, pairs, config.same_p, config.min_pairs)
    label = numbered(looked_up(np.append(owner, -1), basins), config.min_pixels)
    return Instances(label, _sureness(label.astype(np.int32), same, offsets))


def _basins(mask: np.ndarray, same_p: Float32[np.ndarray, "k h w"]) -> tuple[Int32[np.ndarray, "h w"], int]:
    """Return the number of the basin per pixel, -1 outside the mask; and how many there are."""
    (_, reach), (down, _) = OFFSETS[0], OFFSETS[1]
    inside = np.minimum(np.minimum(same_p[0], _moved(same_p[0], 0, reach)), same_p[1])
    inside = np.where(mask, np.minimum(inside, _moved(same_p[1], down, 0)), np.float32(0))
    deep = cv2.distanceTransform((inside > 0.5).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    field = cv2.GaussianBlur(deep + inside, (0, 0), 1.2)
    # Two pairs, each of pixels two apart, cross the step from a pixel to the next.
    right, below = same_p[0] < _WALL, same_p[1] < _WALL
    right[:, 1:] &= right[:, :-1]
    below[1:] &= below[:-1]
    return _climb(kernel_array(field, np.float32), kernel_array(mask, np.bool_), right, below)


def _moved(image: np.ndarray, rows: int, cols: int) -> np.ndarray:
    """Move the image down and to the right; what comes in from outside is 1."""
    out = np.ones_like(image)
    h, w = image.shape
    out[rows:, cols:] = image[: h - rows, : w - cols]
    return out


@njit(cache=True)
def _climb(field, mask, right, below):
    """Send every pixel uphill to the top of its basin, over no wall: `right` of a pixel, or `below` it."""
    height, width = field.shape
    up = np.full(height * width, -1, np.int32)
    for r in range(height):
        for c in range(width):
            if not mask[r, c]:
                continue
            best, at = field[r, c], r * width + c
            for dr in range(-1, 2):
                for dc in range(-1, 2):
                    y, x = r + dr, c + dc
                    if y < 0 or x < 0 or y >= height or x >= width or not mask[y, x]:
                        continue
                    left, top = min(c, x), min(r, y)
                    across = (dc != 0 and right[r, left]) or (dr != 0 and below[top, x])
                    if across and ((dc != 0 and right[y, left]) or (dr != 0 and below[top, c])):
                        continue
                    if field[y, x] > best or (field[y, x] == best and y * width + x < at):
                        best, at = field[y, x], y * width + x
            up[r * width + c] = at
    number = np.full(height * width, -1, np.int32)
    count = 0
    out = np.full((height, width), -1, np.int32)
    for r in range(height):
        for c in range(width):
            at = r * width + c
            if up[at] < 0:
                continue
            peak = at
            while up[peak] != peak:
                peak = up[peak]
            while up[at] != peak:
                at, up[at] = up[at], peak
            if number[peak] < 0:
                number[peak] = count
                count += 1
            out[r, c] = number[peak]
    return out, count


@njit(cache=True)
def _add_up(basins, same, offsets, count):
    """Return the sum of the probabilities of all pairs across each two basins, and the number of pairs; symmetric."""
    height, width = basins.shape
    sums = np.zeros((count, count), np.float32)
    pairs = np.zeros((count, count), np.int32)
    for k in range(offsets.shape[0]):
        dr, dc = offsets[k, 0], offsets[k, 1]
        for r in range(height - dr):
            for c in range(max(0, -dc), width - max(0, dc)):
                a, b = basins[r, c], basins[r + dr, c + dc]
                if a >= 0 and b >= 0 and a != b:
                    sums[a, b] += same[k, r, c]
                    pairs[a, b] += 1
    for a in range(count):
        for b in range(a):
            sums[a, b] += sums[b, a]
            pairs[a, b] += pairs[b, a]
            sums[b, a], pairs[b, a] = sums[a, b], pairs[a, b]
    return sums, pairs


@njit(cache=True)
def _join(sums, pairs, least, min_pairs):
    """Join the two basins with the highest mean repeatedly; return the final owner of each."""
    count = sums.shape[0]
    owner = np.arange(count)
    best = np.full(count, -1, np.int64)
    best_mean = np.full(count, -1.0)
    alive = np.ones(count, np.bool_)
    for a in range(count):
        _find_best(a, sums, pairs, alive, best, best_mean, min_pairs)
    while True:
        a = int(np.argmax(best_mean))
        if best_mean[a] < least:
            return owner
        b = best[a]
        alive[b], best_mean[b] = False, -1.0
        owner[owner == b] = a
        for c in range(count):
            if pairs[b, c] == 0 or not alive[c] or c == a:
                continue
            sums[a, c] += sums[b, c]
            pairs[a, c] += pairs[b, c]
            sums[c, a], pairs[c, a] = sums[a, c], pairs[a, c]
            if best[c] == a or best[c] == b:
                _find_best(c, sums, pairs, alive, best, best_mean, min_pairs)
            elif pairs[c, a] >= min_pairs and sums[c, a] > best_mean[c] * pairs[c, a]:
                best[c], best_mean[c] = a, sums[c, a] / pairs[c, a]
        _find_best(a, sums, pairs, alive, best, best_mean, min_pairs)


@njit(cache=True)
def _find_best(a, sums, pairs, alive, best, best_mean, min_pairs):
    best[a], best_mean[a] = -1, -1.0
    for b in range(sums.shape[0]):
        if alive[b] and b != a and pairs[a, b] >= min_pairs:
            mean = sums[a, b] / pairs[a, b]
            if mean > best_mean[a]:
                best[a], best_mean[a] = b, mean


def numbered(label: Int32[np.ndarray, "h w"], min_pixels: int) -> Int16[np.ndarray, "h w"]:
    """Number masks from 0 on, largest first, dropping those that are too small."""
    sizes = count_labels(label, int(label.max()) + 1)
    order = np.argsort(-sizes, kind="stable")
    kept = order[sizes[order] >= max(min_pixels, 1)]
    number = np.full(len(sizes) + 1, -1, np.int16)
    number[kept] = np.arange(len(kept))
    return np.asarray(looked_up(number, label))


@njit(cache=True)
def _sureness(label, same, offsets):
    count = label.max() + 1
    within, pairs_within = np.zeros(count), np.zeros(count)
    across, pairs_across = np.zeros(count), np.zeros(count)
    height, width = label.shape
    for k in range(offsets.shape[0]):
        dr, dc = offsets[k, 0], offsets[k, 1]
        for r in range(height - dr):
            for c in range(max(0, -dc), width - max(0, dc)):
                a, b = label[r, c], label[r + dr, c + dc]
                if a < 0 and b < 0:
                    continue
                p = same[k, r, c]
                if a == b:
                    within[a] += p
                    pairs_within[a] += 1
                else:
                    for i in (a, b):
                        if i >= 0:
                            across[i] += 1 - p
                            pairs_across[i] += 1
    out = np.empty(count, np.float32)
    for i in range(count):
        out[i] = (
            within[i] / max(pairs_within[i], 1) * (across[i] / pairs_across[i] if pairs_across[i] else 1.0)
        )
    return out
