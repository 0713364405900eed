"""The picture strip of an episode: at each pick the planner's view, its choice, and the outcome."""

import textwrap
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16, UInt8
from PIL import Image, ImageDraw, ImageFont

from torc.records import PickOutcome, PickResult

PANEL_WIDTH = 480
CAPTION_HEIGHT = 92
COLUMNS = 4
_GOOD, _BAD, _INK, _PAPER = (0, 114, 78), (178, 58, 0), (30, 30, 30), (252, 252, 250)


@dataclass(frozen=True)
class Frame:
    """One pick of the strip: the marked image, the choice, and, once known, the outcome."""

    pick: int
    image: UInt8[np.ndarray, "h w 3"]
    chosen: int | None
    reason: str
    outcome: PickOutcome | None = None


Crop = tuple[slice, slice]
"""Rows and columns of an image."""


def crop_around_objects(label_image: Int16[np.ndarray, "h w"], margin_px: int = 28) -> Crop:
    """Return the part with the objects and a margin, in the image's aspect ratio; the whole image without objects."""
    height, width = label_image.shape
    rows, cols = np.nonzero(label_image >= 0)
    if rows.size == 0:
        return slice(0, height), slice(0, width)
    tall, wide = int(np.ptp(rows)) + 2 * margin_px, int(np.ptp(cols)) + 2 * margin_px
    h = min(height, max(tall, wide * height // width))
    w = min(width, h * width // height)
    top = int(np.clip((rows.min() + rows.max() - h) // 2, 0, height - h))
    left = int(np.clip((cols.min() + cols.max() - w) // 2, 0, width - w))
    return slice(top, top + h), slice(left, left + w)


def picture_strip(frames: list[Frame]) -> UInt8[np.ndarray, "h w 3"]:
    """Return all picks side by side, at most COLUMNS in a row."""
    panels = [_panel(frame) for frame in frames]
    columns = min(COLUMNS, len(panels))
    panels += [np.full_like(panels[0], _PAPER[0])] * (-len(panels) % columns)
    return np.vstack([np.hstack(panels[i : i + columns]) for i in range(0, len(panels), columns)])


def _panel(frame: Frame) -> np.ndarray:
    height = round(PANEL_WIDTH * frame.image.shape[0] / frame.image.shape[1])
    picture = Image.fromarray(frame.image).resize((PANEL_WIDTH, height), Image.Resampling.LANCZOS)
    panel = Image.new("RGB", (PANEL_WIDTH, height + CAPTION_HEIGHT), _PAPER)
    panel.paste(picture, (0, 0))
    draw = ImageDraw.Draw(panel)
    choice = "no choice" if frame.chosen is None else f"pick object {frame.chosen}"
    draw.text((10, height + 6), f"{frame.pick + 1}.  {choice}", _INK, ImageFont.load_default(18))
    if frame.outcome is not None:
        color = _GOOD if frame.outcome.result in (PickResult.RETRIEVED, PickResult.REMOVED) else _BAD
        place, text = (PANEL_WIDTH - 10, height + 6), frame.outcome.result.value.upper()
        draw.text(place, text, color, ImageFont.load_default(18), anchor="ra")
    for i, line in enumerate(textwrap.wrap(frame.reason, 70)[:3]):
        draw.text((10, height + 34 + 18 * i), line, _INK, ImageFont.load_default(13))
    return np.asarray(panel)
