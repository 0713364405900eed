"""The contents of a stored frame, and a frame ready for the pipeline."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float32, Int16, Int64, UInt8
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictBool,
    StrictInt,
    model_validator,
)

from torc.geometry.transforms import Pose
from torc.io.strict_yaml import Number
from torc.pipeline.frames.values import parse_intrinsics, parse_pose
from torc.records import ROBOT, Capture, Observation, StereoPair, VoxelGrid

HIDDEN = "hidden"
"""Value of `target` while the target is not in sight."""
_MAX_TEXT = 500
_MAX_VOXELS = 20e6
_LARGEST_UNIT_M = 0.1


class GridSettings(BaseModel):
    """A voxel grid from a file."""

    model_config = ConfigDict(extra="forbid")
    origin: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    voxel_size_m: Number = Field(ge=0.001, le=0.1)
    shape: tuple[int, int, int]

    @model_validator(mode="after")
    def _not_too_large(self) -> "GridSettings":
        if not all(1 <= n <= 1000 for n in self.shape) or np.prod(self.shape) > _MAX_VOXELS:
            raise ValueError(f"shape is {self.shape}; need 1..1000 a side, 20 million in all")
        return self


def _depth_unit(metres: float) -> float:
    """Return metres per unit of depth. Raises ValueError if implausible."""
    if 1e-6 <= metres <= _LARGEST_UNIT_M:
        return metres
    turned = f" {metres:g} looks like units per metre: give {1 / metres:g}" if metres >= 100 else ""
    raise ValueError(
        f"is metres per unit, 0.001 for millimetres; it must be 1e-06 to {_LARGEST_UNIT_M}.{turned}"
    )


class Settings(BaseModel):
    """Everything that a frame holds beside its images."""

    model_config = ConfigDict(extra="forbid")
    K: Annotated[Any, BeforeValidator(parse_intrinsics)]
    T_world_camera: Annotated[Any, BeforeValidator(parse_pose)] = None
    pose_estimated: StrictBool = False
    depth_scale_m: Annotated[Number, AfterValidator(_depth_unit)] = 0.001
    target: StrictInt | str | None = None
    target_description: str = Field("", max_length=_MAX_TEXT)
    support_z_m: Annotated[Number, Field(allow_inf_nan=False)] | None = None
    background: StrictInt | None = None
    robot: StrictInt = ROBOT
    baseline_m: Annotated[Number, Field(gt=0.0, le=10.0)] | None = None
    grid: GridSettings | None = None
    names: dict[int, Annotated[str, BeforeValidator(lambda name: str(name)[:_MAX_TEXT])]] = {}
    version: Literal[1] = 1


@dataclass(frozen=True)
class Frame:
    """One frame, ready for the pipeline.

    Attributes:
        observation: the snapshot.
        label_image: the masks: object id per pixel, 0 to 63, the target being 0. None without masks: a perception then
            has to find the objects.
        target_id: TARGET_ID, or None while the target is hidden or unknown.
        support_z_m: height of the surface that the objects stand on.
        grid: region of the occlusion volume.
        labels, names: label in the file per object id, and name if the file has one.
        warnings: messages for the user: how the file was understood, and what looks wrong in it.
    """

    observation: Observation
    target_id: int | None
    target_description: str
    support_z_m: float
    grid: VoxelGrid
    labels: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    label_image: Int16[np.ndarray, "h w"] | None = None
    support_estimated: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def capture(self) -> Capture:
        """The snapshot with its masks."""
        return Capture(self.observation, self.label_image)

    @property
    def pose_estimated(self) -> bool:
        """True if the pose was estimated; grasps are then not in the robot's base frame."""
        return self.observation.pose_estimated


@dataclass(frozen=True)
class StoredFrame:
    """A frame as it was stored in the file `where`.

    Attributes:
        depth_m: NaN, infinity or 0 where there is no reading.
        labels: in the file's own numbers; None without masks.
        pair: what a stereo camera saw, if it is stored too.
        open_pose: a pose whose name leaves its direction open.
        notes: how the file was understood.
    """

    where: str
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    labels: Int64[np.ndarray, "h w"] | None
    settings: Settings
    pair: StereoPair | None = None
    open_pose: Pose | None = None
    open_pose_key: str = "extrinsics"
    notes: tuple[str, ...] = ()
