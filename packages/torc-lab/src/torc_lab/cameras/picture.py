"""Draw a snapshot as one picture: colour, depth and masks, with pixels that have no depth hatched."""

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from torc import Observation
from torc.drawing.marking import mark_image
from torc.records import SegmentedScene

_GAP_PX = 6
_STRIPE_PX = 4
_HATCH = np.array([(40, 40, 46), (235, 60, 200)], np.uint8)
"""Dark, and a pink that is used neither for depth nor for objects."""
_SHARE = 0.45
"""Weight of the hatch over the picture of masks."""


def snapshot_picture(
    observation: Observation, scene: SegmentedScene | None = None, max_width_px: int | None = None
) -> UInt8[np.ndarray, "h v 3"]:
    """Return colour, depth and masks side by side; in the last two, pixels without depth are hatched.

    Args:
        observation: the snapshot.
        scene: the masks; without it the third picture has none.
        max_width_px: scale the result down to this width if it is wider.
    """
    unseen = ~(observation.depth_m > 0)[..., None]
    rows, cols = np.indices(observation.depth_m.shape)
    hatch = _HATCH[(rows + cols) // _STRIPE_PX % 2]
    masks = observation.rgb if scene is None else mark_image(scene)
    mixed = np.rint(masks + _SHARE * (hatch.astype(np.float32) - masks)).astype(np.uint8)
    depth = np.where(unseen, hatch, depth_colors(observation.depth_m))
    gap = np.full((len(unseen), _GAP_PX, 3), 255, np.uint8)
    picture = np.hstack([observation.rgb, gap, depth, gap, np.where(unseen, mixed, masks)])
    if max_width_px is None or picture.shape[1] <= max_width_px:
        return picture
    height = max(1, round(picture.shape[0] * max_width_px / picture.shape[1]))
    return np.asarray(cv2.resize(picture, (max_width_px, height), interpolation=cv2.INTER_AREA), np.uint8)


def depth_colors(depth_m: Float32[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w 3"]:
    """Return depth as colours from red (near) to blue (far), by rank.

    Each colour gets equally many pixels, so that small things stand out in front of a far wall.
    """
    read = depth_m[depth_m > 0]
    if len(read) == 0:
        return np.zeros((*depth_m.shape, 3), np.uint8)
    shares = np.linspace(0, 100, 129)
    rank = np.interp(depth_m, np.percentile(read, shares), shares / 100)
    turbo = cv2.applyColorMap(np.rint(250 - 225 * rank).astype(np.uint8), cv2.COLORMAP_TURBO)
    return np.ascontiguousarray(turbo[..., ::-1])
