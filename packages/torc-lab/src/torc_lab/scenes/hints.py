"""Find where a misplaced object is now, by searching for its picture near its place."""

import cv2
import numpy as np
from jaxtyping import Float32

from torc import Observation
from torc.records import Capture

_REACH = 0.12
"""How far to search up, down and sideways, as a share of the picture's height."""
_ALIKE = 18.0
"""A place matches if its mean colour difference (CIELAB, 8 bits) is at most this."""
_BETTER = 0.6
"""A match must have less than this share of the cost at the object's proper place."""
_LEAST_M, _MOST_M = 0.004, 0.15


def hint(reference: Capture, seen: Observation, object_id: int) -> str:
    """Return where the object is as the camera sees it, e.g. "2.9 cm too far left, 1.0 cm too near", or ""."""
    found = shift_m(reference, seen, object_id)
    if found is None:
        return ""
    right_m, behind_m = found
    words = ((right_m, ("far left", "far right")), (behind_m, ("near", "far away")))
    return ", ".join(
        f"{abs(by_m) * 100:.1f} cm too {sides[int(by_m > 0)]}"
        for by_m, sides in words
        if abs(by_m) >= _LEAST_M
    )


def shift_m(reference: Capture, seen: Observation, object_id: int) -> tuple[float, float] | None:
    """Return how far an object is to the right of its place and behind it, as the camera sees it, metres.

    None if nothing nearby looks like it, or it has no depth.
    """
    then_seen, label = reference.observation, reference.label_image
    if label is None or not (label == object_id).any():
        return None
    rows, cols = np.nonzero(label == object_id)
    top, bottom, left, right = rows.min(), rows.max() + 1, cols.min(), cols.max() + 1
    reach = max(4, round(_REACH * label.shape[0]))
    height, width = label.shape
    up, down, west, east = (
        max(0, top - reach),
        min(height, bottom + reach),
        max(0, left - reach),
        min(width, right + reach),
    )
    patch, around = _lab(then_seen)[top:bottom, left:right], _lab(seen)[up:down, west:east]
    mask = np.repeat((label[top:bottom, left:right] == object_id)[..., None], 3, axis=2).astype(np.float32)
    cost = np.asarray(cv2.matchTemplate(around, patch, cv2.TM_SQDIFF, mask=mask)) / mask.sum()
    best = np.unravel_index(int(np.argmin(cost)), cost.shape)
    at_home = float(cost[top - up, left - west])
    if cost[best] > _ALIKE**2 or cost[best] >= _BETTER * at_home:
        return None
    by_row, by_col = int(best[0]) - int(top - up), int(best[1]) - int(left - west)
    inside = (rows + by_row >= 0) & (rows + by_row < height) & (cols + by_col >= 0) & (cols + by_col < width)
    then = then_seen.depth_m[rows[inside], cols[inside]]
    now = seen.depth_m[rows[inside] + by_row, cols[inside] + by_col]
    read = (then > 0) & (now > 0)
    if not read.any():
        return None
    z_then, z_now = float(np.median(then[read])), float(np.median(now[read]))
    fx, cx, x = then_seen.K[0, 0], then_seen.K[0, 2], float(cols.mean())
    right_m, behind_m = float((x + by_col - cx) / fx * z_now - (x - cx) / fx * z_then), z_now - z_then
    return (right_m, behind_m) if max(abs(right_m), abs(behind_m)) <= _MOST_M else None


def _lab(observation: Observation) -> Float32[np.ndarray, "h w 3"]:
    return np.asarray(cv2.cvtColor(observation.rgb, cv2.COLOR_RGB2LAB), np.float32)
