"""A frame as the pipeline wants it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from torc.records import Observation, VoxelGrid


@dataclass(frozen=True)
class Frame:
    """One frame, ready for the pipeline.

    Attributes:
        observation: its label_image holds object ids 0..63, the target being 0.
        target_id: TARGET_ID, or None while the target is hidden.
        support_z_m: height of the surface that the objects stand on.
        grid: region of the occlusion volume.
        labels: label in the file per object id.
        names: name per object id, where the file has one.
    """

    observation: Observation
    target_id: int | None
    target_description: str
    support_z_m: float
    grid: VoxelGrid
    labels: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    support_estimated: bool = False
