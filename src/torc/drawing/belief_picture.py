"""The belief over the scene: where in the picture the target may be."""

from collections.abc import Mapping

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from torc.drawing.marking import rim, write_numbers
from torc.records import BeliefEvidence, Decision, SegmentedScene

_COLDEST, _HOTTEST = np.array([120.0, 40.0, 200.0]), np.array([255.0, 225.0, 70.0])
_MOST = 0.85
"""Share of the heat's colour where the belief is densest."""
_BLUR_TILES = 1.2
_DIM, _OUTLINE = 0.6, 165.0
"""Brightness of the image, as a share, and of the outlines, out of 255."""


def draw_belief(
    decision: Decision, scene: SegmentedScene, labels: Mapping[int, int] | None = None
) -> UInt8[np.ndarray, "h w 3"] | None:
    """Draw the belief that a decision rests on: violet where it is thin, yellow where it is densest.

    It lies over the image in grey, with the objects outlined and numbered, the chosen one in white. None if the
    decision rests on no belief. `labels` are numbers to write in place of the ids.
    """
    heat = _heat(decision.evidence.belief, scene.label_image.shape)
    if heat is None:
        return None
    image = _grey(scene, decision.object_id)
    heat = np.sqrt(heat)[..., None]  # else a single peak leaves the rest dark
    share, color = _MOST * heat, _COLDEST + heat * (_HOTTEST - _COLDEST)
    mixed = np.rint(image + share * (color - image)).astype(np.uint8)
    write_numbers(mixed, scene.label_image, {k: (labels or {}).get(k, k) for k in scene.ids})
    return mixed


def _grey(scene: SegmentedScene, chosen: int | None) -> Float[np.ndarray, "h w 3"]:
    """Return the image, dark and without colour, with lighter outlines of the objects."""
    label = np.where(np.isin(scene.label_image, scene.ids), scene.label_image, -1).astype(np.int16)
    grey = _DIM * scene.observation.rgb.astype(float).mean(axis=2)
    px = max(1, label.shape[0] // 480)
    grey[rim(label, px) & (label >= 0)] = _OUTLINE
    if chosen is not None:
        grey[rim(label, 2 * px) & (label == chosen)] = 255.0
    return np.repeat(grey[..., None], 3, axis=2)


def _heat(belief: BeliefEvidence | None, shape: tuple[int, ...]) -> Float[np.ndarray, "h w"] | None:
    """Return the density of the belief at each pixel, 1 at its densest; None if there is nothing to draw."""
    if belief is None or belief.tile_px is None:
        return None
    tile_px, tiles = belief.tile_px, np.array(belief.tiles, dtype=float).reshape(-1, 3)
    rows, cols = shape
    if len(tiles) == 0 or not 1 <= tile_px <= max(shape) or not np.isfinite(tiles).all():
        return None
    heat = np.zeros((-(-rows // tile_px), -(-cols // tile_px)), np.float32)
    at = tiles[:, :2].astype(int)
    inside = (at >= 0).all(axis=1) & (at < heat.shape).all(axis=1)
    heat[tuple(at[inside].T)] = tiles[inside, 2]
    large = heat.repeat(tile_px, axis=0).repeat(tile_px, axis=1)
    smooth = cv2.GaussianBlur(large, (0, 0), _BLUR_TILES * tile_px)[:rows, :cols]
    most = float(smooth.max())
    return None if most <= 0 else np.clip(smooth / most, 0.0, 1.0).astype(float)
