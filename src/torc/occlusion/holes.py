"""Bridge small holes in the depth from the readings around them.

A pixel without a reading is no evidence of anything, and leaves all of its ray unseen. If there are readings close by
on both sides, the surface between them is nearly known: it is the continuation of one side or of the other. The label
image decides which; if it does not, the nearer of the two is used, so that no space is wrongly called free. A flat
surface is continued flat: inverse depth is linear in an image.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, Int32
from numba import njit

from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT

_BASE_PX = 3
"""The slope of a side is taken over at most this many pixels that show one surface."""
_STEEPEST = 4.0
"""Tangent of the steepest view of a surface: 76 degrees. Neighbours further apart in depth are two surfaces."""
_FOREIGN, _NO_SLOPE, _OWN = 1, 2, 3
"""Ranks of two readings around a pixel: neither has its label; one has, but no slope is known there; one has."""


class Bridged(NamedTuple):
    """A depth image with its small holes bridged.

    depth_m: as read; in bridged pixels the least that the surface's depth may be; 0 in what is left of the holes.
    source: the reading that each pixel continues, as an index into the raveled image; elsewhere the pixel itself.
    """

    depth_m: Float32[np.ndarray, "h w"]
    source: Int32[np.ndarray, "h w"]


@njit(cache=True, nogil=True)
def bridge_holes(depth, label, focal_px, hole_rad):
    """Bridge pixels that lie in a small hole: between two readings of a row, a column or a diagonal.

    Between the two, at most `hole_rad` may be background without a reading, in which an unmarked and unread thing could
    stand; in all they may be at most twice that apart.

    A pixel continues the readings with its own label, the nearest of several. A background pixel between objects
    continues the nearer one. A pixel of an object that has readings elsewhere but none close by is free as far as its
    surroundings or the nearest of those readings, less the width of a hole. An object without any reading is not
    bridged, however thin.

    Args:
        depth: metres; 0 where there is no reading.
        label: object per pixel.
        focal_px: focal length.
        hole_rad: width of a hole, as an angle of view.
    """
    height, width = depth.shape
    out = depth.copy()
    source = np.arange(height * width, dtype=np.int32).reshape(height, width)
    nearest = _nearest_by_label(depth, label)
    for row in range(height):
        for col in range(width):
            if depth[row, col] > 0:
                continue
            rank, w, at = _across(depth, label, row, col, _STEEPEST / focal_px, hole_rad * focal_px)
            if rank == _FOREIGN and label[row, col] != BACKGROUND:
                own = nearest[label[row, col] - ROBOT] * (1.0 - hole_rad)
                if own == 0:
                    continue
                if own < 1.0 / w:
                    w, at = 1.0 / own, source[row, col]
            if rank > 0:
                out[row, col] = 1.0 / w
                source[row, col] = at
    return Bridged(out, source)


@njit(cache=True)
def _nearest_by_label(depth, label):
    """Return the least reading under each label, from ROBOT on; 0 if there is none."""
    nearest = np.zeros(MAX_OBJECTS - ROBOT)
    height, width = depth.shape
    for row in range(height):
        for col in range(width):
            d, k = depth[row, col], label[row, col] - ROBOT
            if d > 0 and (d < nearest[k] or nearest[k] == 0):
                nearest[k] = d
    return nearest


@njit(cache=True)
def _across(depth, label, row, col, steepest, widest_px):
    """Return (rank, inverse depth, source) by the four lines through a pixel: the best rank, the nearest of that rank.

    Rank 0 if the pixel lies in no small hole.
    """
    best, best_w, best_at = 0, 0.0, -1
    own = label[row, col]
    for axis in range(4):
        dr, dc = (0, 1) if axis == 0 else (1, axis - 2)
        a, empty_a = _reading_along(depth, label, row, col, -dr, -dc, widest_px)
        if a == 0:
            continue
        b, empty_b = _reading_along(depth, label, row, col, dr, dc, widest_px)
        step = np.sqrt(float(dr * dr + dc * dc))
        empty = empty_a + empty_b + (own == BACKGROUND)
        if b == 0 or empty * step > widest_px or (a + b - 1) * step > 2 * widest_px:
            continue
        ra, ca, rb, cb = row - a * dr, col - a * dc, row + b * dr, col + b * dc
        wa = _continued(depth, ra, ca, -dr, -dc, a, steepest)
        wb = _continued(depth, rb, cb, dr, dc, b, steepest)
        own_a, own_b = label[ra, ca] == own, label[rb, cb] == own
        rank, w, from_a = _between(1.0 / depth[ra, ca], 1.0 / depth[rb, cb], wa, wb, own_a, own_b)
        if rank > best or (rank == best and w > best_w):
            best, best_w = rank, w
            best_at = ra * depth.shape[1] + ca if from_a else rb * depth.shape[1] + cb
    return best, best_w, best_at


@njit(cache=True)
def _between(end_a, end_b, wa, wb, own_a, own_b):
    """Return (rank, inverse depth, whether it continues a) of a pixel between readings a and b.

    Args:
        end_a, end_b: inverse depths there.
        wa, wb: inverse depth of each side continued to the pixel; 0 if its slope is not known.
        own_a, own_b: whether it has the pixel's label.
    """
    farther = min(end_a, end_b)
    if own_a != own_b:
        w = wa if own_a else wb
        if w > 0:
            return _OWN, max(w, farther), own_a
    elif wa > 0 and wb > 0:
        rank = _OWN if own_a else _FOREIGN
        if max(wa, wb) < max(end_a, end_b):
            return rank, max(wa, wb, farther), wa >= wb
        return rank, max(end_a, end_b), end_a >= end_b
    return _NO_SLOPE if own_a or own_b else _FOREIGN, max(end_a, end_b), end_a >= end_b


@njit(cache=True)
def _reading_along(depth, label, row, col, dr, dc, widest_px):
    """Return the steps to the first reading in a direction (0: too far), and the background pixels before it."""
    height, width = depth.shape
    empty = 0
    for n in range(1, int(2 * widest_px) + 1):
        row, col = row + dr, col + dc
        if row < 0 or col < 0 or row >= height or col >= width or empty > widest_px:
            return 0, empty
        if depth[row, col] > 0:
            return n, empty
        empty += label[row, col] == BACKGROUND
    return 0, empty


@njit(cache=True)
def _continued(depth, row, col, dr, dc, steps, steepest):
    """Return the inverse depth `steps` before (row, col) of the surface there and beyond; 0 without a slope."""
    height, width = depth.shape
    step = np.sqrt(float(dr * dr + dc * dc))
    last, base = depth[row, col], 0
    for n in range(1, _BASE_PX + 1):
        r, c = row + n * dr, col + n * dc
        if r < 0 or c < 0 or r >= height or c >= width:
            break
        d = depth[r, c]
        if d == 0:
            continue
        if abs(d - last) > steepest * min(d, last) * (n - base) * step:
            break
        last, base = d, n
    if base == 0:
        return 0.0
    first = 1.0 / depth[row, col]
    return max(first + (first - 1.0 / last) * steps / base, 1e-6)
