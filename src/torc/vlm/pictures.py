"""The pictures of a scene that a model is sent: how they are marked, cropped and enlarged, and what they show."""

import hashlib
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from jaxtyping import Int16, UInt8

from torc.drawing.clear_marks import mark_clearly
from torc.drawing.label_places import mask_anchor
from torc.drawing.marking import mark_pixels, target_in_red
from torc.io.pictures import png_bytes
from torc.records import SegmentedScene
from torc.vlm.picture_config import PictureConfig

ACROSS_PX = 1024
"""Least width or height of the objects in clear pictures, pixels."""
_MARGIN_PX = 24


@dataclass(frozen=True)
class SentPicture:
    """A picture as it was sent: what it shows ("marked" or "plain"), the PNG file, its size in pixels."""

    shows: str
    png: bytes = field(repr=False)
    width: int
    height: int

    @property
    def facts(self) -> dict[str, Any]:
        """Description of the picture for a log."""
        digest = hashlib.sha256(self.png).hexdigest()
        return {"shows": self.shows, "width": self.width, "height": self.height, "sha256": digest}


def pictures_of(scene: SegmentedScene, config: PictureConfig) -> tuple[SentPicture, ...]:
    """Return the pictures of a scene in the order in which they are sent: the marked one, then the plain one if
    enabled.
    """
    drawn = drawn_pictures(scene, config)
    return tuple(SentPicture(k, png_bytes(v), v.shape[1], v.shape[0]) for k, v in drawn.items())


def drawn_pictures(scene: SegmentedScene, config: PictureConfig) -> dict[str, UInt8[np.ndarray, "h w 3"]]:
    """Return the pictures as arrays by what they show: "marked", and "plain" if enabled."""
    rgb, label = shown_part(scene, config)
    label, numbers = target_in_red(label, {i: i for i in scene.ids}, scene.target_id)
    if config.marks == "clear":
        marked = mark_clearly(rgb, label, numbers)
    else:
        marked = mark_pixels(rgb, label, numbers, outlines_only=config.marks == "outlines")
    return {"marked": marked} | ({"plain": rgb} if config.plain else {})


def shown_part(
    scene: SegmentedScene, config: PictureConfig
) -> tuple[UInt8[np.ndarray, "h w 3"], Int16[np.ndarray, "h w"]]:
    """Return colours and ids (-1: no visible object) of the cropped, enlarged part. It holds every visible object.

    For clear marks it is enlarged once by a good filter, and masks have smooth rims at that size.
    """
    label = np.where(np.isin(scene.label_image, scene.ids), scene.label_image, -1).astype(np.int16)
    clear, across, margin_px = config.marks == "clear", max(label.shape), config.crop_px
    if clear and (label >= 0).any():
        across = max(int(np.ptp(at)) + 1 for at in np.nonzero(label >= 0))
    if clear and margin_px is None:
        margin_px = min(_MARGIN_PX, max(4, across // 6))
    rows, cols = _window(label, margin_px)
    rgb, label = scene.observation.rgb[rows, cols], label[rows, cols]
    if config.longest_side_px is not None:
        scale = config.longest_side_px / max(label.shape)
    elif clear:
        scale = max(1.0, ACROSS_PX / across)
    else:
        return np.ascontiguousarray(rgb), np.ascontiguousarray(label)
    size = max(1, round(label.shape[1] * scale)), max(1, round(label.shape[0] * scale))
    if clear:
        enlarged = _enlarged(label, size)
    else:
        enlarged = cv2.resize(label, size, interpolation=cv2.INTER_NEAREST)
    _keep_all(label, enlarged)
    smooth = (cv2.INTER_LANCZOS4 if clear else cv2.INTER_CUBIC) if scale > 1 else cv2.INTER_AREA
    return cv2.resize(rgb, size, interpolation=smooth).astype(np.uint8), enlarged


def _keep_all(label: Int16[np.ndarray, "h w"], resized: Int16[np.ndarray, "H W"]) -> None:
    """Give one pixel of a reduced picture to each object that fell between its pixels, in place."""
    scale = resized.shape[0] / label.shape[0]
    for i in set(np.unique(label).tolist()) - set(np.unique(resized).tolist()) - {-1}:
        row, col = mask_anchor(label == i)
        resized[min(int(row * scale), resized.shape[0] - 1), min(int(col * scale), resized.shape[1] - 1)] = i


def _enlarged(label: Int16[np.ndarray, "h w"], size: tuple[int, int]) -> Int16[np.ndarray, "H W"]:
    """Enlarge labels with smooth rims: each pixel takes the label that most of its surroundings have."""
    most, found = np.zeros(size[::-1], np.float32), np.full(size[::-1], -1, np.int16)
    for i in np.unique(label).tolist():
        share = cv2.resize((label == i).astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
        found[share > most] = i
        most = np.maximum(most, share)
    return found


def _window(label: Int16[np.ndarray, "h w"], margin_px: int | None) -> tuple[slice, slice]:
    """Return rows and columns of the objects with a margin; the whole image if there is no margin or no object."""
    height, width = label.shape
    rows, cols = np.nonzero(label >= 0)
    if margin_px is None or rows.size == 0:
        return slice(0, height), slice(0, width)
    top, left = max(int(rows.min()) - margin_px, 0), max(int(cols.min()) - margin_px, 0)
    return slice(top, int(rows.max()) + 1 + margin_px), slice(left, int(cols.max()) + 1 + margin_px)
