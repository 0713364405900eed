"""Cut pictures of single objects along their masks, at one size, as input of the descriptor."""

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

SIDE_PX = 64
_RIM = 1.12
"""Side of the square that is cut out, as a multiple of the mask's longer side."""


def crop(rgb: UInt8[np.ndarray, "h w 3"], mask: Bool[np.ndarray, "h w"]) -> UInt8[np.ndarray, "s s 4"]:
    """Return the object on black, with the mask as fourth channel (0 or 255). Raises ValueError for an empty mask."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows) == 0:
        raise ValueError("An empty mask shows nothing.")
    top, left, bottom, right = rows[0], cols[0], rows[-1] + 1, cols[-1] + 1
    side = _RIM * max(bottom - top, right - left)
    scale = SIDE_PX / side
    # Moves the middle of the mask's box to the middle of the square.
    shift = [SIDE_PX / 2 - scale * (left + right) / 2, SIDE_PX / 2 - scale * (top + bottom) / 2]
    box = slice(top, bottom), slice(left, right)
    cut = np.dstack([rgb[box], 255 * mask[box].astype(np.uint8)])
    cut[~mask[box]] = 0
    if scale < 0.7:
        cut = cv2.GaussianBlur(cut, (0, 0), 0.35 / scale)
    M = np.array([[scale, 0, shift[0] + scale * left], [0, scale, shift[1] + scale * top]])
    out = cv2.warpAffine(cut, M, (SIDE_PX, SIDE_PX), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(out)


def descriptor_inputs(crops: UInt8[np.ndarray, "n s s 4"]) -> Float32[np.ndarray, "n 4 s s"]:
    """Return the descriptor's inputs: colours from -1 to 1 inside the mask, 0 elsewhere; the mask."""
    mask = crops[..., 3:].astype(np.float32) / 255
    color = (crops[..., :3].astype(np.float32) / 127.5 - 1) * mask
    return np.ascontiguousarray(np.moveaxis(np.concatenate([color, mask], axis=-1), -1, 1))
