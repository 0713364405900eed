"""Boxes: cartons, books and notebooks, phones and remote controls, dice, sponges, and the gable-top carton."""

from collections.abc import Mapping

import numpy as np
from PIL import Image, ImageDraw

from tools.objects.labels import (
    Design,
    Paint,
    box_atlas,
    designed,
    draw_text,
    gradient,
    panel,
    rgb,
    rgba,
    speckled,
)
from tools.objects.meshes import box_mesh, facetted, loft, moved, revolve
from tools.objects.parts import Parts, box, hull, rod
from torc.geometry.transforms import rotation_about

Look = Mapping[str, str]
Size = tuple[float, float, float]


def carton(size_m: Size, design: Look, faces: Mapping[str, Look] | None = None) -> Parts:
    """A cuboid: depth (x), width (y, its labelled front), height (z)."""
    looks = {"front": Design(**design), **{name: Design(**look) for name, look in (faces or {}).items()}}
    return _painted(size_m, designed(looks))


def _painted(size_m: Size, paint: Paint) -> Parts:
    texture, cells = box_atlas(size_m, paint)
    return Parts([box(size_m)], [box_mesh(size_m, cells=cells, texture=texture)])


def gable_carton(size_m: Size, gable_m: float, fin_m: float, design: Look) -> Parts:
    """A milk carton: box, sloping roof, fin; `size_m` includes the roof and the fin."""
    depth, width, height = size_m
    body = height - gable_m - fin_m
    look = Design(**design)
    texture, cells = box_atlas((depth, width, body), designed({"front": look}))
    fin = 0.003
    rings = np.stack([_rectangle(fin, width, body + gable_m), _rectangle(depth, width, body)])
    visuals = [
        box_mesh((depth, width, body), (0, 0, body / 2), cells=cells, texture=texture),
        facetted(loft(rings, rgba=rgba(look.base))),
        box_mesh((fin, width, fin_m), (0, 0, height - fin_m / 2), rgba=rgba(look.accent)),
    ]
    pieces = [
        box((depth, width, body), (0, 0, body / 2)),
        hull(rings.reshape(-1, 3)),
        box((fin, width, fin_m), (0, 0, height - fin_m / 2)),
    ]
    return Parts(pieces, visuals)


def _rectangle(depth: float, width: float, z: float) -> np.ndarray:
    """Corners of a horizontal rectangle, counter-clockwise from above."""
    x, y = depth / 2, width / 2
    return np.array([(x, y, z), (-x, y, z), (-x, -y, z), (x, -y, z)])


def book(size_m: Size, design: Look) -> Parts:
    """A book that lies flat, its cover up and its spine to the left."""
    return _painted(size_m, _bound(Design(**design)))


def notebook(size_m: Size, design: Look, wire: str) -> Parts:
    """A notebook that lies flat, its cover up, bound by a wire spiral on its left; `size_m` is without the spiral."""
    depth, width, height = size_m
    pages = _painted(size_m, _bound(Design(**design)))
    r, half, turns = height / 2, 0.46 * depth, round(depth / 0.008)
    stripes = np.full((8 * turns, 16, 3), rgb("#26282c"), dtype=np.uint8)
    stripes[np.arange(8 * turns) % 8 < 5] = rgb(wire)
    ends = revolve([(r, -half), (0, -half)], segments=20, rgba=rgba(wire))
    coil = [revolve([(0, half), (r, half)], segments=20, rgba=rgba(wire)), ends]
    coil.append(revolve([(r, half), (r, -half)], segments=20, texture=stripes))
    edge, along_x = (0.0, width / 2 + 0.4 * r, 0.0), rotation_about((0, 1, 0), np.pi / 2)
    spiral = rod((-half, edge[1], 0), (half, edge[1], 0), r)
    return Parts([*pages.pieces, spiral], [*pages.visuals, *(moved(c, along_x, edge) for c in coil)])


def _bound(look: Design) -> Paint:
    """Paints a book: cover, spine, pages."""

    def paint(name: str, width: int, height: int) -> Image.Image:
        if name in ("top", "bottom"):
            return panel(width, height, look if name == "top" else Design(look.base, accent=look.base))
        if name == "left":
            words = look.text.replace("\n", " ")
            return panel(width, height, Design(look.base, words, look.base, look.accent))
        pages = Image.new("RGB", (width, height), rgb("#f4efe2"))
        draw = ImageDraw.Draw(pages)
        for y in range(1, height, 3):
            draw.line((0, y, width, y), fill=rgb("#d8d0bd"))
        cover = max(1, height // 10)
        draw.rectangle((0, 0, width, cover), fill=rgb(look.base))
        draw.rectangle((0, height - 1 - cover, width, height), fill=rgb(look.base))
        return pages

    return paint


def phone(size_m: Size, color: str, screen: tuple[str, str], clock: str) -> Parts:
    """A phone that lies on its back: a clock and icons on a screen that blends two colours."""

    def paint(name: str, width: int, height: int) -> Image.Image:
        if name != "top":
            return Image.new("RGB", (width, height), rgb(color))
        w, h = 4 * width, 4 * height
        image = Image.new("RGB", (w, h), rgb("#101114"))
        edge = int(0.05 * w)
        glow = Image.fromarray(gradient(screen, w - 2 * edge, h - 3 * edge))
        image.paste(glow, (edge, int(1.5 * edge)))
        draw_text(image, clock, (0.2 * w, 0.14 * h, 0.8 * w, 0.28 * h), "#ffffff")
        draw = ImageDraw.Draw(image)
        icons = ("#e8453c", "#f2c230", "#3fa34d", "#ffffff", "#3b7dd8", "#e8771e", "#6a3d9a", "#1b8a8f")
        for k, icon in enumerate(icons):
            x, y = (0.16 + 0.19 * (k % 4)) * w, (0.62 + 0.12 * (k // 4)) * h
            draw.rounded_rectangle((x, y, x + 0.12 * w, y + 0.12 * w), radius=0.03 * w, fill=rgb(icon))
        return image.reduce(4)

    return _painted(size_m, paint)


def remote_control(size_m: Size, color: str, buttons: str, accent: str) -> Parts:
    """A remote control that lies flat, its far end away from the robot; buttons are printed."""

    def paint(name: str, width: int, height: int) -> Image.Image:
        if name != "top":
            return Image.new("RGB", (width, height), rgb(color))
        image = Image.new("RGB", (4 * width, 4 * height), rgb(color))
        draw, unit = ImageDraw.Draw(image), width
        _button(draw, unit, 0.55 * unit, 0.3 * unit, accent)
        draw.ellipse((1.0 * unit, 1.6 * unit, 3.0 * unit, 3.6 * unit), fill=rgb(buttons))
        _button(draw, 2 * unit, 2.6 * unit, 0.45 * unit, color)
        rows = np.arange(4.6, 4 * height / unit - 0.7, 0.95)
        for y in rows:
            for x in (0.9, 2.0, 3.1):
                _button(draw, x * unit, y * unit, 0.32 * unit, buttons)
        return image.reduce(4)

    return _painted(size_m, paint)


def _button(draw: ImageDraw.ImageDraw, x: float, y: float, r: float, color: str) -> None:
    draw.ellipse((x - r, y - r, x + r, y + r), fill=rgb(color))


_PIPS = {1: "e", 2: "ai", 3: "aei", 4: "acgi", 5: "acegi", 6: "acdfgi"}
_DIE = {"top": 6, "bottom": 1, "front": 5, "back": 2, "left": 4, "right": 3}


def die(edge_m: float, color: str, pips: str) -> Parts:
    """A big die; opposite faces sum to seven."""

    def paint(name: str, width: int, height: int) -> Image.Image:
        image = Image.new("RGB", (4 * width, 4 * height), rgb(color))
        draw = ImageDraw.Draw(image)
        for letter in _PIPS[_DIE[name]]:
            row, column = divmod("abcdefghi".index(letter), 3)
            _button(draw, width * (0.9 + 1.1 * column), height * (0.9 + 1.1 * row), 0.38 * width, pips)
        return image.reduce(4)

    return _painted((edge_m, edge_m, edge_m), paint)


def letter_block(edge_m: float, color: str, letters: str, frame: str) -> Parts:
    """A wooden block with a letter on each side."""

    def paint(name: str, width: int, height: int) -> Image.Image:
        image = Image.new("RGB", (4 * width, 4 * height), rgb(frame))
        draw = ImageDraw.Draw(image)
        draw.rectangle((0.4 * width, 0.4 * height, 3.6 * width, 3.6 * height), fill=rgb(color))
        index = ("front", "right", "back", "left", "top", "bottom").index(name)
        area = (0.9 * width, 0.9 * height, 3.1 * width, 3.1 * height)
        draw_text(image, letters[index % len(letters)], area, frame)
        return image.reduce(4)

    return _painted((edge_m, edge_m, edge_m), paint)


def sponge(size_m: Size, foam: str, scourer: str) -> Parts:
    """A kitchen sponge: foam below, scourer on top."""
    depth, width, height = size_m
    pad = 0.28 * height
    pores = speckled(foam, _darker(foam), 140)
    soft = box_mesh((depth, width, height - pad), (0, 0, -pad / 2), texture=pores)
    hard = box_mesh(
        (depth, width, pad), (0, 0, (height - pad) / 2), texture=speckled(scourer, _darker(scourer), 400)
    )
    return Parts([box(size_m)], [soft, hard])


def _darker(color: str) -> str:
    return "#{:02x}{:02x}{:02x}".format(*(int(0.78 * c) for c in rgb(color)))
