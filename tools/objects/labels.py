"""Labels drawn with Pillow: coloured bands, readable words and simple pictures. Same pixels on every run.

The font is Pillow's built-in one, so no file is needed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageColor, ImageDraw, ImageFont

from tools.objects.motifs import MOTIFS
from torc.objects.models import Quat

Picture = UInt8[np.ndarray, "h w 3"]
Area = tuple[float, float, float, float]
Area2 = tuple[float, float]
Spot = tuple[float, float, float]
Cells = dict[str, Area]
MAX_TEXTURE_PX = 512


@dataclass(frozen=True)
class Design:
    """How a package looks.

    Attributes:
        base: colour of the package ("#rrggbb").
        text: words on its front; may hold line breaks.
        accent: colour of the band behind the words.
        ink: colour of the words.
        motif: one of MOTIFS, drawn above or below the words.
        motif_color: its colour.
        trim: colour of thin stripes at top and bottom; None without.
    """

    base: str
    text: str = ""
    accent: str = "#ffffff"
    ink: str = "#202020"
    motif: str = "none"
    motif_color: str = "#ffffff"
    trim: str | None = None


def rgb(color: str) -> tuple[int, int, int]:
    """Colour of "#rrggbb"."""
    red, green, blue = ImageColor.getrgb(color)[:3]
    return red, green, blue


def rgba(color: str) -> Quat:
    """Opaque colour of "#rrggbb" as four floats."""
    red, green, blue = rgb(color)
    return red / 255, green / 255, blue / 255, 1.0


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size=size)


def draw_text(image: Image.Image, text: str, area: Area, color: str) -> None:
    """Words as large as fit into the area (x0, y0, x1, y1), centred."""
    x0, y0, x1, y1 = area
    draw = ImageDraw.Draw(image)
    reference = 64
    left, top, right, bottom = draw.multiline_textbbox(
        (0, 0), text, font=_font(reference), align="center", spacing=8
    )
    scale = min((x1 - x0) / max(right - left, 1), (y1 - y0) / max(bottom - top, 1))
    size = max(6, int(reference * scale))
    font, spacing = _font(size), 8 * size / reference
    # Pillow's own font has one weight: a thin outline of the same colour makes it bold enough for a camera.
    stroke = max(0, round(size / 28))
    left, top, right, bottom = draw.multiline_textbbox(
        (0, 0), text, font=font, align="center", spacing=spacing
    )
    x, y = (x0 + x1 - left - right) / 2, (y0 + y1 - top - bottom) / 2
    fill = rgb(color)
    draw.multiline_text(
        (x, y),
        text,
        fill=fill,
        font=font,
        spacing=spacing,
        align="center",
        stroke_width=stroke,
        stroke_fill=fill,
    )


def panel(width: int, height: int, design: Design, margin: float = 0.07) -> Image.Image:
    """The front of a package; `margin`: free width left and right of the words."""
    image = Image.new("RGB", (2 * width, 2 * height), rgb(design.base))
    w, h = image.size
    draw = ImageDraw.Draw(image)
    if design.trim:
        for y in (0.0, 0.94):
            draw.rectangle((0, y * h, w, (y + 0.06) * h), fill=rgb(design.trim))
    band, words, spot = _layout(w, h, margin, bool(design.text), design.motif != "none")
    draw.rectangle((0, band[0], w, band[1]), fill=rgb(design.accent))
    MOTIFS[design.motif](draw, *spot, rgb(design.motif_color))
    if design.text:
        draw_text(image, design.text, words, design.ink)
    return image.reduce(2)


def _layout(w: int, h: int, margin: float, text: bool, motif: bool) -> tuple[Area2, Area, Spot]:
    """Where the band (y0, y1), the words (x0, y0, x1, y1) and the picture (x, y, radius) go."""
    if not text:
        return (0.1 * h, 0.9 * h), (0, 0, 0, 0), (0.5 * w, 0.5 * h, min(0.3 * w, 0.33 * h))
    x0, x1 = margin * w, (1 - margin) * w
    if h >= 0.8 * w:
        low, high = (0.14 * h, 0.5 * h) if motif else (0.25 * h, 0.75 * h)
        return (
            (low, high),
            (x0, low + 0.05 * h, x1, high - 0.05 * h),
            (w / 2, 0.73 * h, min(0.32 * w, 0.19 * h)),
        )
    radius = min(0.13 * (x1 - x0), 0.26 * h)
    right = x1 - 2.4 * radius if motif else x1
    return (0.18 * h, 0.82 * h), (x0, 0.24 * h, right, 0.76 * h), (x1 - radius, h / 2, radius)


def pixels(image: Image.Image) -> Picture:
    """The picture as an array."""
    return np.asarray(image.convert("RGB")).copy()


def wrapped_label(circumference_m: float, height_m: float, design: Design, repeats: int = 2) -> Picture:
    """A label around something round: the same panel `repeats` times, one of them in the middle."""
    width = MAX_TEXTURE_PX
    height = int(np.clip(round(width * height_m / circumference_m), 32, MAX_TEXTURE_PX))
    one = pixels(panel(width // repeats, height, design, margin=0.18))
    return np.roll(np.tile(one, (1, repeats, 1)), (repeats - 1) * width // repeats // 2, axis=1)


def lying_label(length_m: float, circumference_m: float, design: Design) -> Picture:
    """A label for something round that lies along y (its top end at +y): the words run along it, on its upper side."""
    width = MAX_TEXTURE_PX
    height = int(np.clip(round(width * circumference_m / length_m), 64, MAX_TEXTURE_PX))
    around = Image.new("RGB", (width, height), rgb(design.base))
    strip = round(0.36 * height)
    around.paste(panel(width, strip, design), (0, (height - strip) // 2))
    return np.ascontiguousarray(np.rot90(pixels(around), k=-1))


Paint = Callable[[str, int, int], Image.Image]
"""Draws a face of a box: (name of the face, width, height in pixels) -> picture."""


def designed(faces: Mapping[str, Design]) -> Paint:
    """Paints panels. `faces` needs "front"; the back is alike, the other faces are plainer if not given."""
    front = faces["front"]
    plain = Design(front.base, front.text, front.accent, front.ink)
    defaults = {"front": front, "back": front, "left": plain, "right": plain, "top": plain}
    defaults["bottom"] = Design(front.base, accent=front.base)
    return lambda name, width, height: panel(width, height, faces.get(name, defaults[name]))


def box_atlas(size_m: Sequence[float], paint: Paint) -> tuple[Picture, Cells]:
    """One texture for a box (depth x, width y, height z) and the cells (u0, v0, u1, v1) of its faces."""
    depth, width, height = size_m
    scale = min(4000.0, (MAX_TEXTURE_PX - 8) / max(2 * (width + depth), height + depth))
    w, d, h = (max(8, round(scale * s)) for s in (width, depth, height))
    image = Image.new("RGB", (2 * (w + d), h + d))
    layout = {
        "front": (0, 0, w, h),
        "right": (w, 0, d, h),
        "back": (w + d, 0, w, h),
        "left": (2 * w + d, 0, d, h),
        "top": (0, h, w, d),
        "bottom": (w, h, w, d),
    }
    cells = {}
    for name, (x, y, cell_w, cell_h) in layout.items():
        image.paste(paint(name, cell_w, cell_h), (x, y))
        # half a pixel inwards, so that neighbours do not bleed in
        u, v = (
            np.array([x + 0.5, x + cell_w - 0.5]) / image.width,
            np.array([y + 0.5, y + cell_h - 0.5]) / image.height,
        )
        cells[name] = (float(u[0]), float(v[0]), float(u[1]), float(v[1]))
    return pixels(image), cells


def speckled(
    color: str, spots: str, count: int, width: int = 256, height: int = 128, radius: int = 2
) -> Picture:
    """A surface with spots at fixed pseudo-random places (a low-discrepancy sequence)."""
    image = Image.new("RGB", (width, height), rgb(color))
    draw = ImageDraw.Draw(image)
    for i in range(1, count + 1):
        x, y = (i * 0.754877666) % 1.0 * width, (i * 0.569840291) % 1.0 * height
        r = radius * (0.5 + (i * 0.618) % 1.0)
        draw.ellipse((x - r, y - r, x + r, y + r), fill=rgb(spots))
    return pixels(image)


def gradient(colors: tuple[str, ...], width: int = 64, height: int = 128) -> Picture:
    """Colours from top to bottom, blended."""
    stops = np.array([rgb(c) for c in colors], dtype=float)
    t = np.linspace(0, len(colors) - 1, height)
    column = np.stack([np.interp(t, np.arange(len(colors)), stops[:, k]) for k in range(3)], axis=1)
    return np.repeat(np.round(column).astype(np.uint8)[:, None], width, axis=1)
