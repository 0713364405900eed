"""Find a place for the number of each mask: inside its mask, never over another number."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

Size = tuple[int, int]
"""Height and width of a number's box, pixels."""
Window = tuple[slice, slice]
"""Rows and columns of a part of the image."""
Try = tuple[Window, Bool[np.ndarray, "h w"], Size, bool, bool]
"""Where a box may lie: part of the image, allowed pixels in it, size, whether all of the box must lie on those, and
whether that is beside the mask.
"""


@dataclass(frozen=True)
class LabelPlace:
    """The place of a number: its box's upper left pixel, and the mask pixel where it would be best, to which a leader,
    a line, ties a box beside the mask.
    """

    row: int
    col: int
    size: Size
    anchor: tuple[int, int]
    leader: bool


def mask_anchor(mask: Bool[np.ndarray, "h w"]) -> tuple[int, int]:
    """Return the mask pixel nearest to the centre of mass, or the mask's thickest place if that is near the rim.

    Rings and crescents need the latter. Raises ValueError for an empty mask.
    """
    rows, cols = np.nonzero(mask)
    if rows.size == 0:
        raise ValueError("An empty mask has no anchor.")
    top, left = int(rows.min()), int(cols.min())
    crop = np.pad(mask[top : rows.max() + 1, left : cols.max() + 1].astype(np.uint8), 1)
    thickness = cv2.distanceTransform(crop, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    nearest = int(np.argmin((rows - rows.mean()) ** 2 + (cols - cols.mean()) ** 2))
    row, col = int(rows[nearest]), int(cols[nearest])
    if thickness[row - top + 1, col - left + 1] >= 0.5 * thickness.max():
        return row, col
    peak = np.unravel_index(int(np.argmax(thickness)), thickness.shape)
    return int(peak[0]) + top - 1, int(peak[1]) + left - 1


def place_labels(
    label_image: Int16[np.ndarray, "h w"],
    sizes: Mapping[int, tuple[Size, Size]],
    most_hidden: float | None = None,
) -> dict[int, LabelPlace]:
    """Place the number of each id that has pixels, smallest masks first because they have the least choice.

    Tried in turn: wholly inside the mask; centred in it; beside it on free ground; beside it anywhere. With
    `most_hidden`: inside the mask if it hides no larger share of it; beside it on free ground; beside it where it hides
    no larger share of any object; inside anyway. A number without any room is left out (only in tiny images).
    `sizes` has the preferred size of each number's box, and a smaller one.
    """
    found = ndimage.find_objects(label_image.astype(np.int32) + 1)
    windows = {i: found[i] for i in sizes if i < len(found) and found[i] is not None}
    counts = {i: int(np.count_nonzero(label_image[w] == i)) for i, w in windows.items()}
    places: dict[int, LabelPlace] = {}
    for i in sorted(windows, key=lambda i: (counts[i], i)):
        row, col = mask_anchor(label_image[windows[i]] == i)
        anchor = row + windows[i][0].start, col + windows[i][1].start
        for area, allowed, size, whole, leader in _tries(
            label_image, i, windows[i], counts, sizes[i], most_hidden
        ):
            corner = _nearest(_corners(allowed, size, whole), size, anchor, places.values(), area)
            if corner:
                places[i] = LabelPlace(*corner, size, anchor, leader)
                break
    return dict(sorted(places.items()))


def _tries(
    label_image: Int16[np.ndarray, "h w"],
    object_id: int,
    window: Window,
    counts: Mapping[int, int],
    sizes: tuple[Size, Size],
    most_hidden: float | None,
) -> Iterator[Try]:
    """Yield the places where a box may lie, the best first."""
    shape, (large, small) = label_image.shape, sizes
    inside = _grown(window, max(*large, *small), shape)
    near, everywhere = _grown(window, 8 * max(small), shape), _grown(window, max(shape), shape)
    mask, box_px = label_image[inside] == object_id, small[0] * small[1]
    if most_hidden is None:
        yield inside, mask, large, True, False
        yield inside, mask, small, True, False
        # A box that would hide most of its mask goes beside it.
        if counts[object_id] >= 1.3 * box_px:
            yield inside, mask, small, False, False
        yield near, label_image[near] < 0, small, True, True
        yield near, np.ones_like(label_image[near], dtype=bool), small, True, True
    else:
        spared = [i for i, count in counts.items() if box_px > most_hidden * count]
        if object_id not in spared:
            yield inside, mask, small, True, False
        for area in (near, everywhere):
            part = label_image[area]
            yield area, part < 0, small, True, True
            yield area, ~np.isin(part, [*spared, object_id]), small, True, True
        yield inside, mask, small, False, False
    yield everywhere, np.ones(shape, dtype=bool), small, True, True


def _grown(window: Window, px: int, shape: tuple[int, ...]) -> Window:
    rows, cols = (slice(max(w.start - px, 0), min(w.stop + px, n)) for w, n in zip(window, shape))
    return rows, cols


def _corners(mask: Bool[np.ndarray, "h w"], size: Size, whole: bool) -> Bool[np.ndarray, "h w"]:
    """Return the upper left pixels of boxes in the picture that lie wholly (or with their centre) in the mask."""
    height, width = size
    rows, cols = mask.shape[0] - height + 1, mask.shape[1] - width + 1
    out = np.zeros(mask.shape, dtype=bool)
    if rows <= 0 or cols <= 0:
        return out
    if whole:
        kernel = np.ones((height, width), dtype=np.uint8)
        inside = cv2.erode(mask.astype(np.uint8), kernel, anchor=(0, 0), borderType=cv2.BORDER_REPLICATE)
        out[:rows, :cols] = inside[:rows, :cols] > 0
    else:
        top, left = height // 2, width // 2
        out[:rows, :cols] = mask[top : top + rows, left : left + cols]
    return out


def _nearest(
    corners: Bool[np.ndarray, "h w"],
    size: Size,
    anchor: tuple[int, int],
    taken: Iterable[LabelPlace],
    window: Window,
) -> tuple[int, int] | None:
    """Return the corner in a window whose box is centred nearest to the anchor, a pixel away from every box so far."""
    height, width = size
    top, left = window[0].start, window[1].start
    for place in taken:
        rows = slice(max(place.row - height - top, 0), max(place.row + place.size[0] + 1 - top, 0))
        cols = slice(max(place.col - width - left, 0), max(place.col + place.size[1] + 1 - left, 0))
        corners[rows, cols] = False
    rows_free, cols_free = np.nonzero(corners)
    if rows_free.size == 0:
        return None
    down = rows_free + (top + height // 2 - anchor[0])
    right = cols_free + (left + width // 2 - anchor[1])
    best = int(np.argmin(down**2 + right**2))
    return int(rows_free[best]) + top, int(cols_free[best]) + left
