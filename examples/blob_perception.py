"""A perception of one's own: objects are patches above the table that no jump in depth divides.

torc run --perception examples/blob_perception.py:Blobs

It finds the target by a word for its colour in the description, and keeps an object's id by where the object stood.
Things that touch become one; a network does better (docs/extending.md).
"""

import cv2
import numpy as np

from torc import Observation, Wanted
from torc.protocols import BACKGROUND, MAX_OBJECTS, TARGET_ID, PerceptionConfig, SegmentedScene, segment

HUES = {"red": 0, "orange": 15, "yellow": 28, "green": 60, "blue": 110, "purple": 140, "pink": 165}
"""By OpenCV, 0 to 180."""
SAME_PLACE_M = 0.03
ABOVE_M = 0.008


class Blobs:
    """Objects by depth alone."""

    def __init__(self, table_z_m: float = 1.05, jump_m: float = 0.015, far_m: float = 1.5) -> None:
        self.table_z_m, self.jump_m, self.far_m = table_z_m, jump_m, far_m

    def perceive(
        self, observation: Observation, wanted: Wanted, before: SegmentedScene | None
    ) -> SegmentedScene:
        """The patches with enough pixels; the target is the one of the named colour, if there is one."""
        config = PerceptionConfig()
        count, patches = cv2.connectedComponents(self._surface(observation), connectivity=4)
        masks = [patches == k for k in range(1, count)]
        masks = [m for m in masks if np.count_nonzero(m) >= config.min_target_pixels]
        label = np.full(patches.shape, BACKGROUND, dtype=np.int16)
        for mask, object_id in zip(masks, self._ids(masks, observation, wanted, before)):
            label[mask] = object_id
        return segment(observation, label, config)

    def _surface(self, observation: Observation) -> np.ndarray:
        """1 where something stands on the table, 0 on its outlines and elsewhere."""
        depth = np.nan_to_num(observation.depth_m)
        height = world_points(observation)[..., 2] - self.table_z_m
        ranges = cv2.dilate(depth, np.ones((3, 3))) - cv2.erode(depth, np.ones((3, 3)))
        return ((depth > 0) & (depth < self.far_m) & (height > ABOVE_M) & (ranges < self.jump_m)).astype(
            np.uint8
        )

    def _ids(
        self,
        masks: list[np.ndarray],
        observation: Observation,
        wanted: Wanted,
        before: SegmentedScene | None,
    ) -> list[int]:
        """An id per mask: the target's, that of the object that stood there before, or a new one."""
        points = world_points(observation)
        target = _of_color(masks, observation.rgb, wanted.description)
        earlier = {o.id: o.points.mean(axis=0) for o in before.objects} if before is not None else {}
        earlier.pop(TARGET_ID, None)
        fresh = (k for k in range(1, MAX_OBJECTS) if k not in earlier)
        ids = []
        for i, mask in enumerate(masks[: MAX_OBJECTS - 1]):
            middle = points[mask].mean(axis=0)
            near = [k for k, there in earlier.items() if np.linalg.norm(there - middle) < SAME_PLACE_M]
            ids.append(TARGET_ID if i == target else near[0] if near else next(fresh))
            earlier.pop(ids[-1], None)
        return ids


def world_points(observation: Observation) -> np.ndarray:
    """A point per pixel, world frame."""
    rows, columns = np.indices(observation.depth_m.shape)
    K, depth = observation.K, np.nan_to_num(observation.depth_m)
    rays = np.stack(
        [(columns - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1], np.ones(depth.shape)], axis=-1
    )
    T = observation.T_world_camera
    return (rays * depth[..., None]) @ T[:3, :3].T + T[:3, 3]


def _of_color(masks: list[np.ndarray], rgb: np.ndarray, description: str) -> int | None:
    """The mask that is mostly of the colour in the description."""
    named = [hue for word, hue in HUES.items() if word in description.split()]
    if not named or not masks:
        return None
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV).astype(int)
    away = np.abs(hsv[..., 0] - named[0])
    alike = (np.minimum(away, 180 - away) < 10) & (hsv[..., 1] > 90) & (hsv[..., 2] > 50)
    shares = [np.count_nonzero(alike & m) / np.count_nonzero(m) for m in masks]
    best = int(np.argmax(shares))
    return best if shares[best] > 0.5 else None
