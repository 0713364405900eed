"""Found masks beside the true ones, for people to look at."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Int16, UInt8

from torc.drawing.palette import object_color
from torc.records import MAX_OBJECTS

Compared = tuple[UInt8[np.ndarray, "h w 3"], Int16[np.ndarray, "h w"], Int16[np.ndarray, "h w"]]
"""A picture, its true labels, and the labels that were found; below 0 for none."""


def mask_comparison(rows: Sequence[Compared], width: int = 1200) -> UInt8[np.ndarray, "h w 3"]:
    """Draw a row per picture: unmarked, with the true masks, with the found masks. Raises ValueError without rows."""
    if not rows:
        raise ValueError("There is nothing to compare.")
    return np.vstack([_row(*row, width) for row in rows])


def _row(
    rgb: UInt8[np.ndarray, "h w 3"],
    truth: Int16[np.ndarray, "h w"],
    found: Int16[np.ndarray, "h w"],
    width: int,
) -> UInt8[np.ndarray, "a b 3"]:
    tiles = [rgb]
    for labels in (truth, found):
        tile = rgb.copy()
        for k in np.unique(labels[labels >= 0]).tolist():
            tile[labels == k] = object_color(k % MAX_OBJECTS)
        tiles.append(tile)
    wide = np.hstack(tiles)
    height = max(1, round(width / wide.shape[1] * wide.shape[0]))
    return np.asarray(cv2.resize(wide, (width, height), interpolation=cv2.INTER_AREA))
