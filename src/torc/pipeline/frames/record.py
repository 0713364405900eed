"""A frame as it was stored, and as the pipeline wants it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, Self

import numpy as np
from jaxtyping import Float, Float32, Int64, UInt8
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, StrictInt, ValidationError

from torc.errors import InputError
from torc.files.strict_yaml import Number, explain_faults
from torc.records import ROBOT, Observation, VoxelGrid

HIDDEN = "hidden"
"""What `target` says while the target is not in sight."""
_MAX_TEXT = 500
_MAX_VOXELS = 20e6


def finite(value: Any, *shape: int) -> np.ndarray:
    """Finite numbers of that shape. Raises ValueError."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"need {'x'.join(map(str, shape))} finite numbers, not {str(value)[:120]}")
    return array


class GridSettings(BaseModel):
    """A voxel grid out of a file."""

    model_config = ConfigDict(extra="forbid")
    origin: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    voxel_size_m: Number = Field(ge=0.001, le=0.1)
    shape: tuple[int, int, int]

    def grid(self, where: str) -> VoxelGrid:
        """The grid. Raises InputError for one without voxels, or too many."""
        if not all(1 <= n <= 1000 for n in self.shape) or np.prod(self.shape) > _MAX_VOXELS:
            raise InputError(f"{where}: grid.shape is {self.shape}; need 1..1000 a side, 20 million in all.")
        return VoxelGrid(np.array(self.origin), self.voxel_size_m, self.shape)


class Settings(BaseModel):
    """Optional keys that both forms of a file share; names only in a directory."""

    target: Any = None
    target_description: str = Field("", max_length=_MAX_TEXT)
    support_z_m: Annotated[Number, Field(allow_inf_nan=False)] | None = None
    background: StrictInt | None = None
    robot: StrictInt = ROBOT
    grid: GridSettings | None = None
    names: dict[int, Annotated[str, BeforeValidator(lambda name: str(name)[:_MAX_TEXT])]] = {}

    @classmethod
    def checked(cls, where: str, data: Mapping[str, Any]) -> Self:
        """Out of what a file holds. Raises InputError, naming file and keys."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            faults = [f"key {line.strip()}" for line in explain_faults(error).splitlines()]
            raise InputError(f"{where}, {'; '.join(faults)}.") from None


SETTINGS = ("target", "target_description", "support_z_m", "background", "robot")


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
        settings: whatever is optional.
    """

    where: str
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    labels: Int64[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Float[np.ndarray, "4 4"]
    settings: Settings


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
