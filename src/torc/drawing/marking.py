"""The marked image: how a segmented scene is shown to a person or a VLM."""

from collections.abc import Mapping
from math import ceil

import cv2
import numpy as np
from jaxtyping import Bool, Int16, UInt8

from torc.drawing.label_places import LabelPlace, place_labels
from torc.drawing.palette import object_color
from torc.errors import InputError
from torc.records import MAX_OBJECTS, SegmentedScene

# Own digits: a library's font changes with its version, and the images would change with it.
# 5 x 7 cells per digit, one row of digits after another, '#' is ink.
_GLYPHS = """
.###. ..#.. .###. ##### ...#. ##### ..##. ##### .###. .###.
#...# .##.. #...# ...#. ..##. #.... .#... ....# #...# #...#
#...# ..#.. ....# ..#.. .#.#. ####. #.... ...#. #...# #...#
#...# ..#.. ...#. ...#. #..#. ....# ####. ..#.. .###. .####
#...# ..#.. ..#.. ....# ##### ....# #...# ..#.. #...# ....#
#...# ..#.. .#... #...# ...#. #...# #...# ..#.. #...# ...#.
.###. .###. ##### .###. ...#. .###. .###. ..#.. .###. .##..
"""
_SUPERSAMPLING = 12


_TINT, _FAINT_TINT = 0.4, 0.2
"""Share of an object's colour over its pixels; of the other objects' colours when one is highlighted."""
_OUTLINE_PX, _DIGIT_PX, _SMALL_DIGIT_PX, _PADDING_PX = 2, 13, 9, 3
"""Pixels in an image 480 pixels high: outline inside a mask, height of the numbers, their height where a mask has no
room for that, black around a number.
"""
_THIN_PX, _SMALL_PADDING_PX = 1, 2
"""Outline and black around a number, pixels, where colours are unchanged."""
SMALL_SHARE = 0.12
"""Where colours are unchanged, a number may hide at most this share of an object; else it stands beside it."""


def mark_image(
    scene: SegmentedScene, highlight: int | None = None, labels: Mapping[int, int] | None = None
) -> UInt8[np.ndarray, "h w 3"]:
    """Return the colour image with every object tinted and outlined in its own colour and numbered with its id.

    The id stands in white digits in a black box inside the object's mask; where it does not fit, beside the mask, tied
    to it by a thin line. Boxes never overlap. Objects without pixels are skipped.

    Args:
        scene: the scene.
        highlight: id of an object to bring out: a thick outline within a white one, the others fainter.
        labels: numbers to write in place of the ids, not negative; ids that have none keep their own.

    Raises:
        InputError: the highlighted object is not in the scene.
    """
    if highlight is not None and highlight not in scene.ids:
        raise InputError(f"Cannot highlight object {highlight}: visible are {list(scene.ids)}.")
    label = np.where(np.isin(scene.label_image, scene.ids), scene.label_image, -1).astype(np.int16)
    numbers = {i: (labels or {}).get(i, i) for i in scene.ids}
    return mark_pixels(scene.observation.rgb, label, numbers, highlight)


def mark_pixels(
    rgb: UInt8[np.ndarray, "h w 3"],
    label: Int16[np.ndarray, "h w"],
    numbers: Mapping[int, int],
    highlight: int | None = None,
    *,
    outlines_only: bool = False,
) -> UInt8[np.ndarray, "h w 3"]:
    """Return a copy of an image, marked like `mark_image`.

    Args:
        rgb: the image.
        label: the label of each pixel; -1 for none.
        numbers: the number to write, by label.
        highlight: a label to bring out.
        outlines_only: keep the colours: a thin outline along each mask's rim, and a small number, in the mask if it
            hides little of it, else beside it with a line. All other pixels are unchanged.
    """
    scale = _scale(label.shape, outlines_only)
    image = rgb.copy() if outlines_only else _tint(rgb, label, highlight)
    px = ceil(_THIN_PX * scale) if outlines_only else round(_OUTLINE_PX * scale)
    _outline(image, label, highlight, px)
    write_numbers(image, label, numbers, small=outlines_only)
    return image


def write_numbers(
    image: UInt8[np.ndarray, "h w 3"],
    label: Int16[np.ndarray, "h w"],
    numbers: Mapping[int, int],
    *,
    small: bool = False,
) -> None:
    """Write a number into, or beside, the mask of each label, in place. `small` as for `outlines_only` in
    `mark_pixels`.
    """
    boxes = number_boxes(label.shape, numbers, small=small)
    places = number_places(label, numbers, small=small)
    _draw_leaders(image, places)
    for i, place in places.items():
        box = next(b for b in boxes[i] if b.shape == place.size)
        height, width = place.size
        image[place.row : place.row + height, place.col : place.col + width] = box[..., None]


def number_places(
    label: Int16[np.ndarray, "h w"], numbers: Mapping[int, int], *, small: bool = False
) -> dict[int, LabelPlace]:
    """Return where `write_numbers` writes these numbers."""
    boxes = number_boxes(label.shape, numbers, small=small)
    sizes = {i: (large.shape, tight.shape) for i, (large, tight) in boxes.items()}
    return place_labels(label, sizes, SMALL_SHARE if small else None)


def number_boxes(
    shape: tuple[int, ...], numbers: Mapping[int, int], *, small: bool = False
) -> dict[int, tuple[UInt8[np.ndarray, "a b"], UInt8[np.ndarray, "c d"]]]:
    """Return the boxes of each number in an image of that shape: the preferred one, and one for little room."""
    scale = _scale(shape, small)
    heights = (_SMALL_DIGIT_PX, _SMALL_DIGIT_PX) if small else (_DIGIT_PX, _SMALL_DIGIT_PX)
    padding = round((_SMALL_PADDING_PX if small else _PADDING_PX) * scale)
    large, tight = (max(5, round(px * scale)) for px in heights)
    return {i: (number_box(n, large, padding), number_box(n, tight, padding)) for i, n in numbers.items()}


def _scale(shape: tuple[int, ...], thin: bool) -> float:
    """Return the factor on the sizes above. Thin marks go by the longest side: crops are wide and low."""
    return max(1.0, max(shape[0] / 480, shape[1] / 640) if thin else shape[0] / 480)


def _tint(
    rgb: UInt8[np.ndarray, "h w 3"], label: Int16[np.ndarray, "h w"], highlight: int | None
) -> UInt8[np.ndarray, "h w 3"]:
    """Return a copy of the image with the objects tinted."""
    share = np.full(MAX_OBJECTS, _TINT if highlight is None else _FAINT_TINT)
    if highlight is not None:
        share[highlight] = _TINT
    weight = np.append(share, 0.0)[label][..., None].astype(np.float32)  # label -1 reads the last entry
    color = _palette()[label].astype(np.float32)
    return np.rint(rgb + weight * (color - rgb)).astype(np.uint8)


def _outline(
    image: UInt8[np.ndarray, "h w 3"], label: Int16[np.ndarray, "h w"], highlight: int | None, px: int
) -> None:
    """Draw the rims of all masks in their colours, in place."""
    inner = rim(label, px) & (label >= 0)
    image[inner] = _palette()[label[inner]]
    if highlight is not None:
        mask = (label == highlight).astype(np.uint8)
        image[(rim(mask, 2 * px)) & (mask > 0)] = _palette()[highlight]
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))
        image[(cv2.dilate(mask, kernel) > 0) & (mask == 0)] = 255


def rim(label: np.ndarray, px: int) -> Bool[np.ndarray, "h w"]:
    """Return the pixels (h, w) of a label image or mask within px of another label or of the image's border."""
    padded = np.pad(label, px, constant_values=-3 if label.dtype == np.int16 else 0)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))
    inner = (slice(px, -px), slice(px, -px))
    return (cv2.erode(padded, kernel)[inner] != label) | (cv2.dilate(padded, kernel)[inner] != label)


def number_image(number: int, height_px: int) -> UInt8[np.ndarray, "h w"]:
    """Return the ink (0..255) of a number's digits, `height_px` high, without a border."""
    rows = [line.split() for line in _GLYPHS.split("\n") if line]
    gap = "."
    text = [gap.join(row[int(digit)] for digit in str(number)) for row in rows]
    cells = np.array([[255 * (c == "#") for c in line] for line in text], dtype=np.uint8)
    large = np.kron(cells, np.ones((_SUPERSAMPLING, _SUPERSAMPLING), dtype=np.uint8))
    width_px = max(1, round(cells.shape[1] * height_px / cells.shape[0]))
    return cv2.resize(large, (width_px, height_px), interpolation=cv2.INTER_AREA).astype(np.uint8)


def number_box(number: int, digit_px: int, padding_px: int) -> UInt8[np.ndarray, "h w"]:
    """Return white digits on black, at least as wide as high."""
    ink = np.pad(number_image(number, digit_px), padding_px)
    missing = max(0, ink.shape[0] - ink.shape[1])
    return np.pad(ink, ((0, 0), (missing // 2, missing - missing // 2)))


def _draw_leaders(image: UInt8[np.ndarray, "h w 3"], places: dict[int, LabelPlace]) -> None:
    """Draw lines in the objects' colours, edged with black, to the masks from the boxes beside them."""
    for i, place in places.items():
        if place.leader:
            start = (place.col + place.size[1] // 2, place.row + place.size[0] // 2)
            end = (place.anchor[1], place.anchor[0])
            cv2.line(image, start, end, (0, 0, 0), 3)
            cv2.line(image, start, end, object_color(i), 1)


def _palette() -> UInt8[np.ndarray, "ids 3"]:
    return np.array([object_color(i) for i in range(MAX_OBJECTS)], dtype=np.uint8)
