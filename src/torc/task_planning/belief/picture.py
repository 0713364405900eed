"""The belief over the scene: where in the picture the target may be."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from torc.perception.marking import mark_image, write_numbers
from torc.records import Decision, SegmentedScene

_COLDEST, _HOTTEST = np.array([120.0, 40.0, 200.0]), np.array([255.0, 225.0, 70.0])
_MOST = 0.85
"""Share of the heat's colour where the belief is densest."""
_BLUR_TILES = 1.2


def draw_belief(
    decision: Decision, scene: SegmentedScene, labels: Mapping[int, int] | None = None
) -> UInt8[np.ndarray, "h w 3"] | None:
    """The marked image, its choice brought out, with the belief that a decision rests on: violet where little of it is,
    yellow where most.

    It is looked for in `evidence["belief"]` as the planner `belief` leaves it; None where there is none that can be
    drawn. `labels` are numbers to write in place of the ids, as in `mark_image`.
    """
    heat = _heat(decision.evidence.get("belief"), scene.label_image.shape)
    if heat is None:
        return None
    chosen = decision.object_id if decision.object_id in scene.ids else None
    image = mark_image(scene, highlight=chosen, labels=labels).astype(float)
    heat = np.sqrt(heat)[..., None]  # else a single peak leaves the rest dark
    share, color = _MOST * heat, _COLDEST + heat * (_HOTTEST - _COLDEST)
    mixed = np.rint(image + share * (color - image)).astype(np.uint8)
    write_numbers(mixed, scene.label_image, {k: (labels or {}).get(k, k) for k in scene.ids})
    return mixed


def _heat(belief: Any, shape: tuple[int, ...]) -> Float[np.ndarray, "h w"] | None:
    """How dense the belief is at each pixel, from 0 to 1 at its densest; None if this is no belief."""
    try:
        tile_px = int(belief["tile_px"])
        tiles = np.array(belief["tiles"], dtype=float).reshape(-1, 3)
    except (KeyError, TypeError, ValueError):
        return None
    rows, cols = shape
    if len(tiles) == 0 or not 1 <= tile_px <= max(shape) or not np.isfinite(tiles).all():
        return None
    heat = np.zeros((-(-rows // tile_px), -(-cols // tile_px)), np.float32)
    at = tiles[:, :2].astype(int)
    inside = (at >= 0).all(axis=1) & (at < heat.shape).all(axis=1)
    heat[tuple(at[inside].T)] = tiles[inside, 2]
    large = cv2.resize(
        heat, (heat.shape[1] * tile_px, heat.shape[0] * tile_px), interpolation=cv2.INTER_NEAREST
    )
    smooth = cv2.GaussianBlur(large, (0, 0), _BLUR_TILES * tile_px)[:rows, :cols]
    most = float(smooth.max())
    return None if most <= 0 else np.clip(smooth / most, 0.0, 1.0).astype(float)
