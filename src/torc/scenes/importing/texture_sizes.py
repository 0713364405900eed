"""Textures that are larger together than those of one object may be."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from torc.scenes.models import VisualMesh

_STEP = 0.9


def fitting_textures(visuals: Sequence[VisualMesh], max_pixels: int) -> tuple[list[VisualMesh], float]:
    """The surfaces with textures that have no more than max_pixels together, and by how much they were scaled for it.

    All are scaled alike; 1.0 where they fit as they are.
    """
    textures = [v.texture for v in visuals if v.texture is not None]
    factor = 1.0
    while sum(int(np.prod(_size(t, factor))) for t in textures) > max_pixels:
        factor *= _STEP
    if factor == 1.0:
        return list(visuals), factor
    scaled = {id(t): _scaled(t, factor) for t in {id(t): t for t in textures}.values()}  # sides share theirs
    return [v if v.texture is None else replace(v, texture=scaled[id(v.texture)]) for v in visuals], factor


def _size(texture: np.ndarray, factor: float) -> tuple[int, int]:
    """Width and height after scaling."""
    height, width = texture.shape[:2]
    return max(1, int(factor * width)), max(1, int(factor * height))


def _scaled(texture: UInt8[np.ndarray, "h w 3"], factor: float) -> UInt8[np.ndarray, "k l 3"]:
    small = Image.fromarray(texture).resize(_size(texture, factor), Image.Resampling.LANCZOS)
    return np.asarray(small, np.uint8)
