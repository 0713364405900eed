"""A frame as it was stored, and as the pipeline wants it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int64, UInt8

from torc.records import Observation, VoxelGrid

HIDDEN = "hidden"
"""What `target` says while the target is not in sight."""
SETTINGS = ("target", "target_description", "support_z_m", "background", "robot")
"""Optional keys that both forms of a file share."""


@dataclass(frozen=True)
class RawFrame:
    """A frame as it was stored.

    Attributes:
        where: the file, for messages.
        rgb: colour image.
        depth_m: metres; NaN, infinite or 0 where there is no reading.
        labels: instance per pixel, in the file's own numbers.
        K: intrinsics.
        T_world_camera: camera pose, not yet checked.
        settings: whatever is optional, by key.
    """

    where: str
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    labels: Int64[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Float[np.ndarray, "4 4"]
    settings: Mapping[str, Any]

    def key(self, name: str) -> str:
        """Where a setting stands, for messages."""
        return f"{self.where}, key {name}"


@dataclass(frozen=True)
class Frame:
    """One frame, ready for the pipeline.

    Attributes:
        observation: its label_image holds object ids 0..63, the target being 0.
        target_id: TARGET_ID, or None while the target is hidden.
        target_description: the target in words; may be empty.
        support_z_m: height of the surface that the objects stand on.
        grid: region of the occlusion volume.
        labels: label in the file per object id.
        names: name per object id, where the file has one.
        support_estimated: whether support_z_m was estimated from the image.
    """

    observation: Observation
    target_id: int | None
    target_description: str
    support_z_m: float
    grid: VoxelGrid
    labels: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    support_estimated: bool = False
