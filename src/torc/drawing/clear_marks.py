"""Marks that hide as little as possible: for questions to models, at the resolution of the picture that is sent.

Outlines in colours that differ between neighbours and never cover more than a fifth of an object, dotted lines between
the pieces of one object, and small numbers that avoid small objects.
"""

from collections.abc import Iterator, Mapping

import cv2
import numpy as np
from jaxtyping import Bool, Int16, UInt8
from scipy import ndimage
from scipy.spatial import cKDTree

from torc.drawing.label_places import place_labels
from torc.drawing.marking import SMALL_SHARE, disk, draw_boxes, number_box, rim
from torc.drawing.palette import object_color
from torc.records import TARGET_ID

Color = tuple[int, int, int]
MOST_COVERED = 0.2
"""Largest share of an object that its own outline may cover; otherwise the outline lies around it."""
_OUTLINES_PX = (3, 2, 1)
_DIGIT_PX, _PADDING_PX = 15, 4
_NEAR_PX = 40
_APART = 60.0
"""Least distance in CIELAB at which colours differ enough."""
_COLORS = 16
"""How many colours of the palette are tried; later ones resemble these."""
_LEAST_PIECE_PX = 60
_DOT_PX, _DOT_STEP_PX = 2, 9


def mark_clearly(
    rgb: UInt8[np.ndarray, "h w 3"], label: Int16[np.ndarray, "h w"], numbers: Mapping[int, int]
) -> UInt8[np.ndarray, "h w 3"]:
    """Return a copy of an image, marked with outlines, links and numbers, by the label of each pixel (-1: none)."""
    image, colors = rgb.copy(), neighbour_colors(label, tuple(numbers))
    for i, color in colors.items():
        _outline(image, label, i, color)
    for i, color in colors.items():
        for start, end in piece_links(label == i):
            _dotted(image, start, end, color)
    boxes = {i: (number_box(n, _DIGIT_PX, _PADDING_PX),) * 2 for i, n in numbers.items()}
    places = place_labels(label, {i: (b.shape, b.shape) for i, (b, _) in boxes.items()}, SMALL_SHARE)
    draw_boxes(image, places, boxes, colors, cv2.LINE_AA)
    return image


def neighbour_colors(label: Int16[np.ndarray, "h w"], ids: tuple[int, ...]) -> dict[int, Color]:
    """Return a colour for each id that has pixels: its own, unless another differs more from its neighbours'."""
    near = _neighbours(label, ids)
    lab = _lab([object_color(k) for k in range(_COLORS)])
    chosen: dict[int, int] = {}
    # Most neighbours first: they have the least choice.
    for i in sorted(near, key=lambda i: (-len(near[i]), i)):
        taken = [lab[chosen[k]] for k in near[i] if k in chosen]
        used = list(chosen.values())
        apart = np.array([min((float(np.linalg.norm(c - t)) for t in taken), default=np.inf) for c in lab])
        if i != TARGET_ID:
            apart[TARGET_ID] = -np.inf  # red is the target's
        enough = apart >= min(_APART, apart.max())
        # Of the colours that differ enough, the object's own, else the rarest.
        chosen[i] = min(np.flatnonzero(enough).tolist(), key=lambda c: (c != i, used.count(c), c))
    return {i: object_color(c) for i, c in sorted(chosen.items())}


def piece_links(mask: Bool[np.ndarray, "h w"]) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yield the shortest lines, from (row, column) to (row, column), that join all pieces of a mask except specks."""
    pieces, count = ndimage.label(mask, np.ones((3, 3)))
    areas = np.bincount(pieces.ravel(), minlength=count + 1)
    largest = [k for k in range(1, count + 1) if areas[k] >= _LEAST_PIECE_PX]
    places = [np.argwhere(pieces == k) for k in sorted(largest, key=lambda k: (-areas[k], k))]
    joined, left = places[:1], places[1:]
    while left:
        tree, around = cKDTree(np.concatenate(joined)), np.concatenate(joined)
        found = [tree.query(place) for place in left]
        nearest = min(range(len(left)), key=lambda k: float(found[k][0].min()))
        far, index = found[nearest]
        at = int(far.argmin())
        (r, c), (row, col) = around[int(index[at])], left[nearest][at]
        yield (int(r), int(c)), (int(row), int(col))
        joined.append(left.pop(nearest))


def _neighbours(label: Int16[np.ndarray, "h w"], ids: tuple[int, ...]) -> dict[int, set[int]]:
    """Return, for each id that has pixels, the others within _NEAR_PX of them."""
    found = ndimage.find_objects(label.astype(np.int32) + 1)
    near: dict[int, set[int]] = {}
    for i in ids:
        if i >= len(found) or found[i] is None:
            continue
        area = tuple(slice(max(s.start - _NEAR_PX, 0), s.stop + _NEAR_PX) for s in found[i])
        part = label[area]
        grown = cv2.dilate((part == i).astype(np.uint8), disk(_NEAR_PX)) > 0
        near[i] = (set(np.unique(part[grown]).tolist()) & set(ids)) - {i}
    return {i: near[i] | {k for k in near if i in near[k]} for i in near}


def _outline(
    image: UInt8[np.ndarray, "h w 3"], label: Int16[np.ndarray, "h w"], i: int, color: Color
) -> None:
    mask = label == i
    for px in _OUTLINES_PX:
        inner = rim(label, px) & mask
        if np.count_nonzero(inner) <= MOST_COVERED * np.count_nonzero(mask):
            image[inner] = color
            return
    image[(cv2.dilate(mask.astype(np.uint8), disk(2)) > 0) & (label < 0)] = color


def _dotted(
    image: UInt8[np.ndarray, "h w 3"], start: tuple[int, int], end: tuple[int, int], color: Color
) -> None:
    a, b = np.array(start[::-1], float), np.array(end[::-1], float)
    steps = max(2, round(float(np.linalg.norm(b - a)) / _DOT_STEP_PX))
    for s in np.linspace(0.0, 1.0, steps + 1):
        col, row = np.rint(a + s * (b - a)).astype(int).tolist()
        cv2.circle(image, (col, row), _DOT_PX + 1, (0, 0, 0), -1)
        cv2.circle(image, (col, row), _DOT_PX, color, -1)


def _lab(colors: list[Color]) -> np.ndarray:
    pixels = np.array([colors], np.float32) / 255
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2LAB)[0], dtype=np.float64)
