"""The pictures that a model is sent of a scene: how they are marked, cropped and enlarged, and what they show."""

import hashlib
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from jaxtyping import Int16, UInt8

from torc.perception.label_places import mask_anchor
from torc.perception.marking import mark_pixels
from torc.records import SegmentedScene
from torc.records.files import png_bytes
from torc.vlm.picture_config import PictureConfig


@dataclass(frozen=True)
class SentPicture:
    """A picture as it was sent: what it shows ("marked" or "plain"), the PNG file, its size in pixels."""

    shows: str
    png: bytes = field(repr=False)
    width: int
    height: int

    @property
    def facts(self) -> dict[str, Any]:
        """For a log."""
        digest = hashlib.sha256(self.png).hexdigest()
        return {"shows": self.shows, "width": self.width, "height": self.height, "sha256": digest}


def pictures_of(scene: SegmentedScene, config: PictureConfig) -> tuple[SentPicture, ...]:
    """The pictures of a scene, in the order in which they are sent: the marked one, then the plain one if asked for."""
    drawn = drawn_pictures(scene, config)
    return tuple(SentPicture(k, png_bytes(v), v.shape[1], v.shape[0]) for k, v in drawn.items())


def drawn_pictures(scene: SegmentedScene, config: PictureConfig) -> dict[str, UInt8[np.ndarray, "h w 3"]]:
    """The same as arrays, by what they show: "marked", and "plain" if asked for."""
    rgb, label = shown_part(scene, config)
    marked = mark_pixels(rgb, label, {i: i for i in scene.ids}, outlines_only=config.marks == "outlines")
    return {"marked": marked} | ({"plain": rgb} if config.plain else {})


def shown_part(
    scene: SegmentedScene, config: PictureConfig
) -> tuple[UInt8[np.ndarray, "h w 3"], Int16[np.ndarray, "h w"]]:
    """Colours and ids (-1: no visible object) of what is shown, cropped and enlarged. Every visible object is in it."""
    label = np.where(np.isin(scene.label_image, scene.ids), scene.label_image, -1).astype(np.int16)
    rows, cols = _window(label, config.crop_px)
    rgb, label = scene.observation.rgb[rows, cols], label[rows, cols]
    if config.longest_side_px is None:
        return np.ascontiguousarray(rgb), np.ascontiguousarray(label)
    scale = config.longest_side_px / max(label.shape)
    size = max(1, round(label.shape[1] * scale)), max(1, round(label.shape[0] * scale))
    smooth = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    resized = cv2.resize(label, size, interpolation=cv2.INTER_NEAREST)
    for i in set(np.unique(label).tolist()) - set(np.unique(resized).tolist()) - {-1}:
        # In a reduced picture: an object that fell between the pixels that were kept.
        row, col = mask_anchor(label == i)
        resized[min(int(row * scale), size[1] - 1), min(int(col * scale), size[0] - 1)] = i
    return cv2.resize(rgb, size, interpolation=smooth).astype(np.uint8), resized


def _window(label: Int16[np.ndarray, "h w"], margin_px: int | None) -> tuple[slice, slice]:
    """Rows and columns of the objects with a margin; all of the image without one, or without objects."""
    height, width = label.shape
    rows, cols = np.nonzero(label >= 0)
    if margin_px is None or rows.size == 0:
        return slice(0, height), slice(0, width)
    top, left = max(int(rows.min()) - margin_px, 0), max(int(cols.min()) - margin_px, 0)
    return slice(top, int(rows.max()) + 1 + margin_px), slice(left, int(cols.max()) + 1 + margin_px)
