"""Open dishes with straight sides: baking dishes and baskets."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from PIL import Image, ImageDraw

from tools.objects.labels import Picture, pixels, rgb, rgba
from tools.objects.meshes import box_mesh, disc, facetted, loft
from tools.objects.parts import Parts, box, prism, side_walls
from torc.objects.models import VisualMesh

Ring = Float[np.ndarray, "s 3"]
_CORNER = 4
"""Points per rounded corner."""


def open_dish(
    base_m: tuple[float, float],
    rim_m: tuple[float, float],
    height_m: float,
    wall_m: float,
    color: str,
    inside: str,
    lugs: bool = False,
    woven: bool = False,
) -> Parts:
    """A baking dish or a basket: (depth, width) at the base and at the rim, rounded corners.

    `lugs`: with two handles, left and right; `woven`: of wicker.
    """
    h, t = height_m, wall_m
    outer = np.stack([_rounded(rim_m, h), _rounded(base_m, 0)])
    inner = np.stack([_rounded(_narrower(rim_m, t), h), _rounded(_narrower(base_m, t), t)])
    rim = facetted(loft(np.stack([inner[0], outer[0]]), caps=False, rgba=rgba(inside if woven else color)))
    if woven:
        walls = _woven(outer, wicker(color, inside))
        lining = _woven(inner[:, ::-1], wicker(inside, color))
    else:
        walls = loft(outer, caps=False, rgba=rgba(color))
        lining = loft(inner[:, ::-1], caps=False, rgba=rgba(inside))
    floor, base = disc(inner[1], rgba=rgba(inside)), disc(outer[1, ::-1], rgba=rgba(color))
    visuals = [walls, lining, rim, floor, base]
    pieces = [prism(outer[1][:, :2].tolist(), 0, t), *side_walls(outer, inner)]
    for side in (-1, 1) if lugs else ():
        size, at = (0.45 * rim_m[0], 0.022, 0.009), (0, side * (rim_m[1] / 2 + 0.008), h - 0.007)
        visuals.append(box_mesh(size, at, rgba=rgba(color)))
        pieces.append(box(size, at))
    return Parts(pieces, visuals)


def _woven(rings: Float[np.ndarray, "2 s 3"], texture: Picture) -> VisualMesh:
    """A wall whose texture is spread evenly along its rings."""
    edges = np.linalg.norm(np.roll(rings[0], -1, axis=0) - rings[0], axis=1)
    u = np.concatenate([[0.0], np.cumsum(edges)]) / edges.sum()
    uv = np.stack([np.tile(u, 2), np.repeat([0.0, 1.0], len(u))], axis=1)
    return replace(loft(rings, caps=False, texture=texture), uv=np.minimum(uv, 1.0))


def _narrower(size: tuple[float, float], wall: float) -> tuple[float, float]:
    return size[0] - 2 * wall, size[1] - 2 * wall


def _rounded(size: tuple[float, float], z: float) -> Ring:
    """A rectangle with rounded corners, counter-clockwise from above; always with the same number of points."""
    x, y = size[0] / 2, size[1] / 2
    r = 0.3 * min(x, y)
    t = np.linspace(0, np.pi / 2, _CORNER)
    corners = []
    for k, (cx, cy) in enumerate(((x - r, y - r), (r - x, y - r), (r - x, r - y), (x - r, r - y))):
        a = t + k * np.pi / 2
        corners.append(np.stack([cx + r * np.cos(a), cy + r * np.sin(a), np.full(_CORNER, z)], axis=1))
    return np.concatenate(corners)


def wicker(color: str, dark: str, columns: int = 40, rows: int = 9) -> Picture:
    """A weave: short bars, every other row shifted by half a bar."""
    tile = Image.new("RGB", (12, 24), rgb(dark))
    draw = ImageDraw.Draw(tile)
    for x, y in ((0, 0), (-6, 12), (6, 12)):
        draw.rounded_rectangle((x + 0.5, y + 1.5, x + 10.5, y + 10.5), radius=4, fill=rgb(color))
    return np.tile(pixels(tile), (-(-rows // 2), columns, 1))[: 12 * rows]
