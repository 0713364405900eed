"""What perception makes of a snapshot."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float32, Int16, Int32

from torc.records.camera import Observation


@dataclass(frozen=True)
class SegmentedObject:
    """One visible object: its part of the surface point cloud, world frame.

    Attributes:
        id: object id, 0..63; its value in the label image.
        points: surface points, metres.
        normals: unit normals, towards the camera.
        pixels: (row, column) of each point in the image.
        pixel_count: pixels of the object's mask, with or without a depth reading.
        felt: points that a finger touched where no snapshot saw anything; in no image.
    """

    id: int
    points: Float32[np.ndarray, "n 3"]
    normals: Float32[np.ndarray, "n 3"]
    pixels: Int32[np.ndarray, "n 2"]
    pixel_count: int
    felt: Float32[np.ndarray, "k 3"] = field(default_factory=lambda: np.zeros((0, 3), np.float32))


@dataclass(frozen=True)
class SegmentedScene:
    """All that was perceived in one snapshot.

    Attributes:
        label_image: object id per pixel; BACKGROUND or ROBOT elsewhere. A task planner is shown the visible objects
            alone, here and in the observation; perception itself may leave in what it does not report.
        objects: visible objects, by rising id.
        target_id: id of the target, or None while it is hidden.
        background_points: surface points of no object (table, bin), world frame.
    """

    observation: Observation
    label_image: Int16[np.ndarray, "h w"]
    objects: tuple[SegmentedObject, ...]
    target_id: int | None
    background_points: Float32[np.ndarray, "m 3"]

    @cached_property
    def ids(self) -> tuple[int, ...]:
        """Ids of the visible objects, rising."""
        return tuple(o.id for o in self.objects)

    def object(self, object_id: int) -> SegmentedObject:
        """The visible object with that id. Raises KeyError if there is none."""
        for o in self.objects:
            if o.id == object_id:
                return o
        raise KeyError(f"No visible object {object_id}; visible: {self.ids}.")
