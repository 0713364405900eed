"""The schema of object.yaml and its limits."""

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator

from torc.geometry.transforms import Pose, make_pose, rotation_from_wxyz
from torc.io.strict_yaml import Number, printable
from torc.objects.models import PieceKind, Quat, Vec3

FORMAT = "torc-object/1"
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.\-]{0,63}$"
MAX_YAML_BYTES = 100_000
MAX_DESCRIPTION = 120
MAX_PIECES = 64
MAX_PIECE_VERTICES = 512
MAX_VISUALS = 64
MAX_FACES = 200_000
MAX_VERTICES = 600_000
MAX_TEXTURE_PX = 2048
"""Longest side."""
MIN_SIZE_M, MAX_SIZE_M = 0.003, 1.0
"""Limits of the bounding box's edges: thinner things slip through contacts, larger ones do not fit the table."""
MIN_MASS_KG, MAX_MASS_KG = 0.001, 30.0
MIN_FRICTION, MAX_FRICTION = 0.05, 3.0

_PIECE_SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "capsule": 2, "ellipsoid": 3, "mesh": 0}
_Length = Annotated[Number, Field(gt=0.0, le=MAX_SIZE_M)]
_Coordinate = Annotated[Number, Field(ge=-1e6, le=1e6)]
_Color = Annotated[Number, Field(ge=0.0, le=1.0)]


def _line(text: str) -> str:
    if "\n" in text:
        raise ValueError("must be a single line.")
    return printable(text)


def _unit(wxyz: Quat) -> Quat:
    if abs(math.hypot(*wxyz) - 1.0) > 1e-6:
        raise ValueError("is no unit quaternion (order w, x, y, z).")
    return wxyz


def _thick_enough(size_m: Vec3) -> Vec3:
    if min(size_m) < MIN_SIZE_M:
        raise ValueError(f"every edge must be at least {1000 * MIN_SIZE_M:.0f} mm.")
    return size_m


Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Description = Annotated[str, Field(min_length=1, max_length=MAX_DESCRIPTION), AfterValidator(_line)]
_Note = Annotated[str, Field(max_length=2000), AfterValidator(_line)]
_Unit = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit)]


class PieceEntry(BaseModel, extra="forbid", allow_inf_nan=False):
    kind: PieceKind
    size: Annotated[tuple[_Length, ...], Field(max_length=3)] = ()
    position: tuple[_Coordinate, _Coordinate, _Coordinate] = (0.0, 0.0, 0.0)
    wxyz: _Unit = (1.0, 0.0, 0.0, 0.0)
    relative_density: Annotated[Number, Field(ge=1e-3, le=1e3)] = 1.0

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        wanted = _PIECE_SIZES[self.kind]
        if len(self.size) != wanted:
            raise ValueError(f"a {self.kind} has {wanted} sizes, not {len(self.size)}.")
        return self


class VisualEntry(BaseModel, extra="forbid", allow_inf_nan=False):
    rgba: tuple[_Color, _Color, _Color, _Color] = (1.0, 1.0, 1.0, 1.0)
    texture: Annotated[str, Field(pattern=r"^texture_[0-9]{1,2}\.png$")] | None = None
    uv: bool = False
    normals: bool = False

    @model_validator(mode="after")
    def _texture_needs_uv(self) -> Self:
        if self.texture is not None and not self.uv:
            raise ValueError("a texture needs texture coordinates (uv: true).")
        return self


class ObjectSource(BaseModel, extra="forbid", allow_inf_nan=False, frozen=True):
    """Where an imported object comes from.

    A mesh file (empty if there is none), its hash, and a note for people, e.g. a licence. A point p of it is R(wxyz)
    (scale * p) + position in the model frame.
    """

    file: Annotated[str, Field(max_length=255), AfterValidator(_line)] = ""
    sha256: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")] = ""
    note: _Note = ""
    scale: Annotated[Number, Field(gt=0.0, le=1e6)] = 1.0
    position: tuple[_Coordinate, _Coordinate, _Coordinate] = (0.0, 0.0, 0.0)
    wxyz: _Unit = (1.0, 0.0, 0.0, 0.0)

    @property
    def T_object_mesh(self) -> Pose:
        """Pose of the scaled mesh's frame in the model frame."""
        return make_pose(rotation_from_wxyz(self.wxyz), self.position)


class ObjectFile(BaseModel, extra="forbid", allow_inf_nan=False):
    format: Literal["torc-object/1"]
    name: Name
    kind: Name
    description: Description
    mass_kg: Annotated[Number, Field(ge=MIN_MASS_KG, le=MAX_MASS_KG)]
    friction: Annotated[Number, Field(ge=MIN_FRICTION, le=MAX_FRICTION)] = 0.8
    rolls: bool = False
    held_out: bool = True
    size_m: Annotated[tuple[_Length, _Length, _Length], AfterValidator(_thick_enough)]
    source: ObjectSource = ObjectSource()
    pieces: Annotated[list[PieceEntry], Field(min_length=1, max_length=MAX_PIECES)]
    visuals: Annotated[list[VisualEntry], Field(min_length=1, max_length=MAX_VISUALS)]
