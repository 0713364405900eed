"""The marked image: how a segmented scene is shown to a person or a VLM."""

from collections.abc import Mapping, Sequence
from functools import cache
from math import ceil

import cv2
import numpy as np
from jaxtyping import Bool, Int16, UInt8

from torc.drawing.label_places import LabelPlace, place_labels
from torc.drawing.palette import object_color
from torc.errors import InputError
from torc.records import MAX_OBJECTS, TARGET_ID, SegmentedScene
from torc.records.derived import once

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
Boxes = tuple[UInt8[np.ndarray, "a b"], UInt8[np.ndarray, "c d"]]
"""The preferred box of a number, and one for little room."""
Compared = tuple[UInt8[np.ndarray, "h w 3"], Int16[np.ndarray, "h w"], Int16[np.ndarray, "h w"]]
"""A picture, its true labels, and the labels that were found; below 0 for none."""


def mark_image(
    scene: SegmentedScene, highlight: int | None = None, labels: Mapping[int, int] | None = None
) -> UInt8[np.ndarray, "h w 3"]:
    """Return the colour image with every object tinted and outlined in its own colour and numbered with its id.

    The id stands in white digits in a black box inside the object's mask; where it does not fit, beside the mask, tied
    to it by a thin line. Boxes never overlap. Objects without pixels are skipped. `highlight` brings out an object by a
    thick outline within a white one, with the others fainter. `labels` are numbers to write in place of the ids, not
    negative; ids that have none keep their own. Raises InputError if the highlighted object is not in the scene.
    """
    if highlight is not None and highlight not in scene.ids:
        raise InputError(f"Cannot highlight object {highlight}: visible are {list(scene.ids)}.")
    label = np.where(np.isin(scene.label_image, scene.ids), scene.label_image, -1).astype(np.int16)
    numbers = {i: (labels or {}).get(i, i) for i in scene.ids}
    if scene.target_id is not None and highlight == scene.target_id:
        highlight = TARGET_ID
    label, numbers = target_in_red(label, numbers, scene.target_id)
    # A look is often marked twice: as it was seen, and with the choice.
    places = once(scene, ("places of numbers", *numbers.items()), lambda: number_places(label, numbers))
    return mark_pixels(scene.observation.rgb, label, numbers, highlight, places=places)


def target_in_red(
    label: Int16[np.ndarray, "h w"], numbers: Mapping[int, int], target_id: int | None
) -> tuple[Int16[np.ndarray, "h w"], dict[int, int]]:
    """Return labels and their numbers with the target under the label 0, whose colour is red; its number stays."""
    if target_id is None or target_id == TARGET_ID:
        return label, dict(numbers)
    others = {TARGET_ID if k == target_id else k: n for k, n in numbers.items()}
    return np.where(label == target_id, np.int16(TARGET_ID), label), dict(sorted(others.items()))


def mark_pixels(
    rgb: UInt8[np.ndarray, "h w 3"],
    label: Int16[np.ndarray, "h w"],
    numbers: Mapping[int, int],
    highlight: int | None = None,
    *,
    outlines_only: bool = False,
    places: Mapping[int, LabelPlace] | None = None,
) -> UInt8[np.ndarray, "h w 3"]:
    """Return a copy of an image, marked like `mark_image`, by the label of each pixel (-1: none), with these numbers.

    `outlines_only` keeps the colours: a thin outline along each mask's rim, and a small number, in the mask if it hides
    little of it, else beside it with a line. All other pixels are unchanged. `places` are those of the numbers, if they
    are known.
    """
    scale = _scale(label.shape, outlines_only)
    image = rgb.copy() if outlines_only else _tint(rgb, label, highlight)
    px = ceil(_THIN_PX * scale) if outlines_only else round(_OUTLINE_PX * scale)
    _outline(image, label, highlight, px)
    write_numbers(image, label, numbers, small=outlines_only, places=places)
    return image


def write_numbers(
    image: UInt8[np.ndarray, "h w 3"],
    label: Int16[np.ndarray, "h w"],
    numbers: Mapping[int, int],
    *,
    small: bool = False,
    places: Mapping[int, LabelPlace] | None = None,
) -> None:
    """Write a number into, or beside, the mask of each label, in place. `small` is for `outlines_only`.

    `places` are those of the numbers, if they are known.
    """
    places = number_places(label, numbers, small=small) if places is None else places
    colors = {i: object_color(i) for i in places}
    draw_boxes(image, places, number_boxes(label.shape, numbers, small=small), colors)


def draw_boxes(
    image: UInt8[np.ndarray, "h w 3"],
    places: Mapping[int, LabelPlace],
    boxes: Mapping[int, Boxes],
    colors: Mapping[int, tuple[int, int, int]],
    line: int = cv2.LINE_8,
) -> None:
    """Draw each number's box at its place, and a line, edged with black, from a box beside its mask to the mask."""
    for i, place in places.items():
        if place.leader:
            start = (place.col + place.size[1] // 2, place.row + place.size[0] // 2)
            cv2.line(image, start, place.anchor[::-1], (0, 0, 0), 3, line)
            cv2.line(image, start, place.anchor[::-1], colors[i], 1, line)
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
) -> dict[int, Boxes]:
    """Return the boxes of each number in an image of that shape."""
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
    share = np.full((MAX_OBJECTS, 1, 1), _TINT if highlight is None else _FAINT_TINT, np.float32)
    if highlight is not None:
        share[highlight] = _TINT
    before, color = np.arange(256, dtype=np.float32)[:, None], _palette()[:, None].astype(np.float32)
    after = np.rint(before + share * (color - before)).astype(np.uint8)  # by label, value and channel
    image, marked = rgb.copy(), label >= 0
    image[marked] = after[label[marked][:, None], rgb[marked], np.arange(3)]
    return image


def _outline(
    image: UInt8[np.ndarray, "h w 3"], label: Int16[np.ndarray, "h w"], highlight: int | None, px: int
) -> None:
    """Draw the rims of all masks in their colours, in place."""
    inner = rim(label, px) & (label >= 0)
    image[inner] = _palette()[label[inner]]
    if highlight is not None:
        whole = (label == highlight).astype(np.uint8)
        left, top, width, height = cv2.boundingRect(whole)
        grown = [slice(max(at - 2 * px, 0), at + n + 2 * px) for at, n in ((top, height), (left, width))]
        near = grown[0], grown[1]
        part, mask = image[near], whole[near]
        part[rim(mask, 2 * px) & (mask > 0)] = _palette()[highlight]
        part[(cv2.dilate(mask, disk(px)) > 0) & (mask == 0)] = 255


def disk(px: int) -> UInt8[np.ndarray, "n n"]:
    """Return the kernel that reaches px pixels in every direction."""
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1)).astype(np.uint8)


def rim(label: np.ndarray, px: int) -> Bool[np.ndarray, "h w"]:
    """Return the pixels (h, w) of a label image or mask within px of another label or of the image's border."""
    padded = np.pad(label, px, constant_values=-3 if label.dtype == np.int16 else 0)
    inner = (slice(px, -px), slice(px, -px))
    return (cv2.erode(padded, disk(px))[inner] != label) | (cv2.dilate(padded, disk(px))[inner] != label)


def number_image(number: int, height_px: int) -> UInt8[np.ndarray, "h w"]:
    """Return the ink (0..255) of a number's digits, `height_px` high, without a border."""
    rows = [line.split() for line in _GLYPHS.split("\n") if line]
    gap = "."
    text = [gap.join(row[int(digit)] for digit in str(number)) for row in rows]
    cells = np.array([[255 * (c == "#") for c in line] for line in text], dtype=np.uint8)
    large = np.kron(cells, np.ones((_SUPERSAMPLING, _SUPERSAMPLING), dtype=np.uint8))
    width_px = max(1, round(cells.shape[1] * height_px / cells.shape[0]))
    return cv2.resize(large, (width_px, height_px), interpolation=cv2.INTER_AREA).astype(np.uint8)


@cache
def number_box(number: int, digit_px: int, padding_px: int) -> UInt8[np.ndarray, "h w"]:
    """Return white digits on black, at least as wide as high; read-only."""
    ink = np.pad(number_image(number, digit_px), padding_px)
    missing = max(0, ink.shape[0] - ink.shape[1])
    box = np.pad(ink, ((0, 0), (missing // 2, missing - missing // 2)))
    box.flags.writeable = False
    return box


def mask_comparison(rows: Sequence[Compared], width: int = 1200) -> UInt8[np.ndarray, "h w 3"]:
    """Draw a row per picture: unmarked, with the true masks, with the found masks. Raises ValueError without rows."""
    if not rows:
        raise ValueError("There is nothing to compare.")
    drawn = []
    for rgb, *labelled in rows:
        tiles = [rgb, rgb.copy(), rgb.copy()]
        for tile, labels in zip(tiles[1:], labelled):
            tile[labels >= 0] = _palette()[labels[labels >= 0] % MAX_OBJECTS]
        wide = np.hstack(tiles)
        height = max(1, round(width / wide.shape[1] * wide.shape[0]))
        drawn.append(cv2.resize(wide, (width, height), interpolation=cv2.INTER_AREA))
    return np.vstack(drawn)


@cache
def _palette() -> UInt8[np.ndarray, "ids 3"]:
    return np.array([object_color(i) for i in range(MAX_OBJECTS)], dtype=np.uint8)
