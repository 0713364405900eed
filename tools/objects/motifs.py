"""Simple pictures for labels: each draws itself about (x, y) with a radius r, in pixels."""

from collections.abc import Callable

import numpy as np
from PIL import ImageDraw

Draw = ImageDraw.ImageDraw
Color = tuple[int, int, int]


def _none(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    """No picture."""


def _disc(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.ellipse((x - r, y - r, x + r, y + r), fill=color)


def _star(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    t = np.pi / 5 * np.arange(10) - np.pi / 2
    radii = np.where(np.arange(10) % 2 == 0, r, 0.42 * r)
    draw.polygon([(x + q * np.cos(a), y + q * np.sin(a)) for a, q in zip(t, radii)], fill=color)


def _sun(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    for a in np.pi / 6 * np.arange(12):
        draw.line((x, y, x + r * np.cos(a), y + r * np.sin(a)), fill=color, width=max(2, int(r / 8)))
    _disc(draw, x, y, 0.6 * r, color)


def _leaf(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    t = np.linspace(-1, 1, 21)
    side = 0.45 * r * np.cos(np.pi / 2 * t)
    points = [*zip(x + r * t, y + side), *zip(x + r * t[::-1], y - side)]
    draw.polygon(points, fill=color)
    dark = (color[0] // 2, color[1] // 2, color[2] // 2)
    draw.line((x - r, y, x + r, y), fill=dark, width=max(2, int(r / 16)))


def _fish(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.ellipse((x - r, y - 0.45 * r, x + 0.6 * r, y + 0.45 * r), fill=color)
    draw.polygon([(x + 0.4 * r, y), (x + r, y - 0.5 * r), (x + r, y + 0.5 * r)], fill=color)
    draw.ellipse((x - 0.72 * r, y - 0.2 * r, x - 0.56 * r, y - 0.04 * r), fill=(20, 20, 20))


def _drop(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    _disc(draw, x, y + 0.3 * r, 0.65 * r, color)
    draw.polygon([(x, y - r), (x - 0.58 * r, y + 0.05 * r), (x + 0.58 * r, y + 0.05 * r)], fill=color)


def _fruit(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    _disc(draw, x, y + 0.15 * r, 0.8 * r, color)
    _leaf(draw, x + 0.35 * r, y - 0.75 * r, 0.4 * r, (60, 140, 50))


def _square(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.rectangle((x - 0.8 * r, y - 0.8 * r, x + 0.8 * r, y + 0.8 * r), fill=color)


def _squares(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    for dx, dy in ((-0.55, -0.2), (0.5, -0.4), (0.1, 0.5)):
        _square(draw, x + dx * r, y + dy * r, 0.5 * r, color)


def _bowl(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.pieslice((x - r, y - r, x + r, y + r), 0, 180, fill=color)
    for dx in (-0.5, 0.0, 0.5):
        _disc(draw, x + dx * r, y - 0.12 * r, 0.25 * r, (235, 180, 60))


def _flame(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    _drop(draw, x, y, r, color)
    _drop(draw, x, y + 0.25 * r, 0.5 * r, (255, 220, 90))


def _heart(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.polygon(_heart_outline(x, y, r), fill=color)


def _heart_outline(x: float, y: float, r: float) -> list[tuple[float, float]]:
    """The classic curve; a negative radius turns it upside down."""
    t = np.linspace(0, 2 * np.pi, 41)
    up = 13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t)
    return [*zip(x + r * 16 * np.sin(t) ** 3 / 17, y - r * up / 17)]


def _spade(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.polygon(_heart_outline(x, y - 0.1 * r, -0.9 * r), fill=color)
    draw.polygon([(x, y), (x - 0.35 * r, y + 0.95 * r), (x + 0.35 * r, y + 0.95 * r)], fill=color)


def _diamond(draw: Draw, x: float, y: float, r: float, color: Color) -> None:
    draw.polygon([(x, y - r), (x + 0.7 * r, y), (x, y + r), (x - 0.7 * r, y)], fill=color)


MOTIFS: dict[str, Callable[[Draw, float, float, float, Color], None]] = {
    "none": _none,
    "disc": _disc,
    "star": _star,
    "sun": _sun,
    "leaf": _leaf,
    "fish": _fish,
    "drop": _drop,
    "fruit": _fruit,
    "square": _square,
    "squares": _squares,
    "bowl": _bowl,
    "flame": _flame,
    "heart": _heart,
    "spade": _spade,
    "diamond": _diamond,
}
