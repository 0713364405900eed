"""A page for diagrams: curves, disks and text in pixels of the finished picture.

Everything is drawn at twice the size and halved at the end, which smooths all edges.
"""

from functools import cache
from itertools import groupby

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

Color = tuple[int, int, int]
INK: Color = (40, 40, 44)
PAPER: Color = (255, 255, 255)
Curve = Float[np.ndarray, "n 2"]
_OVERSAMPLING = 2
_font = cache(ImageFont.load_default)


class Canvas:
    def __init__(self, width_px: int, height_px: int) -> None:
        self.width_px, self.height_px = width_px, height_px
        self._image = Image.new("RGB", (width_px * _OVERSAMPLING, height_px * _OVERSAMPLING), PAPER)
        self._pen = ImageDraw.Draw(self._image)

    def stroke(
        self, curve: Curve, color: Color, width_px: float, dash_px: tuple[float, float] | None
    ) -> None:
        """Draw a line through points that lie about a pixel apart; `dash_px`: length drawn, length left out."""
        steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
        starts = np.cumsum(steps) - steps
        drawn = np.ones(len(starts), bool) if dash_px is None else starts % sum(dash_px) < dash_px[0]
        points, first = curve * _OVERSAMPLING, 0
        for is_drawn, pieces in groupby(drawn.tolist()):
            last = first + len(list(pieces))
            if is_drawn:
                line = points[first : last + 1].ravel().tolist()
                self._pen.line(line, fill=color, width=round(width_px * _OVERSAMPLING))
            first = last

    def arrow_head(self, curve: Curve, color: Color) -> None:
        tip, back = curve[-1], curve[max(0, len(curve) - 8)]
        along = (tip - back) / max(float(np.linalg.norm(tip - back)), 1e-9)
        side = np.array([-along[1], along[0]])
        corners = np.array([tip, tip - 11 * along + 4.5 * side, tip - 11 * along - 4.5 * side])
        self._pen.polygon((corners * _OVERSAMPLING).ravel().tolist(), fill=color)

    def disk(self, x: float, y: float, radius_px: float, fill: Color) -> None:
        self._pen.ellipse(_square(x, y, radius_px), fill=fill)

    def broken_ring(self, x: float, y: float, radius_px: float) -> None:
        for start in range(0, 360, 30):
            self._pen.arc(_square(x, y, radius_px), start, start + 16, INK, round(1.6 * _OVERSAMPLING))

    def text(
        self,
        at: tuple[float, float],
        text: str,
        height_px: int,
        color: Color,
        *,
        anchor: str = "mm",
        boxed: bool = False,
    ) -> float:
        """Write text, over a blank box if `boxed`, and return where it ends. `anchor` is Pillow's."""
        font = _font(height_px * _OVERSAMPLING)
        place = at[0] * _OVERSAMPLING, at[1] * _OVERSAMPLING
        left, top, right, bottom = self._pen.textbbox(place, text, font=font, anchor=anchor)
        if boxed:
            self._pen.rectangle((left - 2, top - 2, right + 2, bottom + 2), fill=PAPER)
        self._pen.text(place, text, fill=color, font=font, anchor=anchor)
        return right / _OVERSAMPLING

    def finish(self) -> UInt8[np.ndarray, "h w 3"]:
        return np.array(self._image.reduce(_OVERSAMPLING))


def smooth_curve(route: Curve) -> Float[np.ndarray, "m 2"]:
    """Return points of a curve through the route's waypoints, about a pixel apart (Catmull-Rom)."""
    padded = np.concatenate([2 * route[:1] - route[1:2], route, 2 * route[-1:] - route[-2:-1]])
    pieces = []
    for p0, p1, p2, p3 in zip(padded, padded[1:], padded[2:], padded[3:]):
        t = np.linspace(0, 1, max(8, int(np.linalg.norm(p2 - p1))), endpoint=False)[:, None]
        bend = (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2 + (3 * p1 - p0 - 3 * p2 + p3) * t**3
        pieces.append(0.5 * (2 * p1 + (p2 - p0) * t + bend))
    return np.concatenate([*pieces, route[-1:]])


def _square(x: float, y: float, half_px: float) -> list[float]:
    return [v * _OVERSAMPLING for v in (x - half_px, y - half_px, x + half_px, y + half_px)]
