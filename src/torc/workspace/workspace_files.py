"""Workspace files (`torc-workspace/1`): table, bin, camera and watched region."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from torc.errors import InputError, UnknownNameError
from torc.geometry.transforms import look_at, project
from torc.io.digests import fingerprint
from torc.io.strict_yaml import Number, read_yaml_as
from torc.records import VoxelGrid
from torc.workspace.description import Bin, Box, CameraMount, Room, Workspace

DATA = Path(__file__).parent / "data"
"""The directory of the shipped workspaces."""
EXAMPLE = DATA / "paper.yaml"
"""A shipped workspace, to compare with."""
_MAX_BYTES = 100_000
_MAX_VOXELS = 20_000_000
_SUPPORT_TOLERANCE_M = 0.005
_FOV_DEG = (5.0, 160.0)
_APART_M = 1e-3
_FARTHEST_M = 8.0
_ACROSS = 21
_LEAST_SEEN = 0.05
"""Least share of the region's floor over the table that the camera must see."""
Positive = Annotated[Number, Field(gt=0.0)]
Vec = tuple[Number, Number, Number]
Size = tuple[Positive, Positive, Positive]


@cache
def workspace_names() -> tuple[str, ...]:
    """Return the names of the shipped workspaces."""
    return tuple(sorted(p.stem for p in DATA.glob("*.yaml")))


def load_workspace(name_or_path: str | Path = "paper") -> Workspace:
    """Load a workspace: table, bin, camera and watched region.

    Args:
        name_or_path: name of a shipped workspace ("paper"), or path of a YAML file.

    Raises:
        UnknownNameError: it is neither.
        InputError: the file is wrong; the message names file, field and remedy.
    """
    path = Path(name_or_path)
    if path.suffix in {".yaml", ".yml"} and path.is_file():
        return _read(path)
    if str(name_or_path) not in workspace_names():
        own = f", or a YAML file of your own; compare {EXAMPLE}"
        raise UnknownNameError("workspace (nor a YAML file)", str(name_or_path), list(workspace_names()), own)
    return _shipped(str(name_or_path))


def own_workspace_source(name_or_path: str) -> str:
    """Return the fingerprint of a user-defined workspace; "" for a shipped one. Raises like `load_workspace`."""
    workspace = load_workspace(name_or_path)
    return "" if name_or_path in workspace_names() else workspace.source


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _BoxEntry(_Strict):
    center: Vec
    size: Size


class _Obstacle(_BoxEntry):
    name: Annotated[str, Field(pattern=r"^[A-Za-z][\w-]{0,63}$")]


class _BinEntry(_Strict):
    floor_center: Vec
    inner_size: Size
    wall: Positive = 0.02
    drop_position: Vec


class _CameraEntry(_Strict):
    """The camera: an ideal pinhole. Its pose, OpenCV axes, is a matrix, or a position and a point that it looks at."""

    position: Vec | None = None
    look_at: Vec | None = None
    T_world_camera: list[list[Number]] | None = None
    width: Annotated[int, Field(ge=16, le=4096)] = 640
    height: Annotated[int, Field(ge=16, le=4096)] = 480
    vertical_fov_deg: Number

    @field_validator("vertical_fov_deg")
    @classmethod
    def _lens(cls, value: float) -> float:
        low, high = _FOV_DEG
        if low <= value <= high:
            return value
        turned = float(np.rad2deg(value))
        hint = f". Is it in radians? Then write {turned:.1f}" if low <= turned <= high else ""
        raise ValueError(f"must be {low:g} to {high:g} degrees, not {value:g}{hint}")

    @model_validator(mode="after")
    def _one_pose(self) -> "_CameraEntry":
        seen_from = self.position is not None and self.look_at is not None
        if seen_from == (self.T_world_camera is not None):
            raise ValueError("give either position and look_at, or T_world_camera")
        if self.T_world_camera is not None:
            T = np.array(self.T_world_camera, dtype=float)
            rigid = T.shape == (4, 4) and np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-4)
            if not rigid or np.linalg.det(T[:3, :3]) < 0 or not np.allclose(T[3], [0, 0, 0, 1]):
                raise ValueError("T_world_camera must be a 4x4 rigid transform, without scale or mirror")
        elif self.position is not None and self.look_at is not None:
            view = np.subtract(self.look_at, self.position)
            if np.linalg.norm(view[:2]) < max(_APART_M, 1e-6 * float(np.linalg.norm(view))):
                raise ValueError(
                    "look_at is the camera's position, or straight above or below it: give a point on the table to its "
                    "front, or T_world_camera, which also says how it is turned"
                )
        return self

    def mount(self) -> CameraMount:
        if self.position is not None and self.look_at is not None:
            T = look_at(self.position, self.look_at)
        else:
            T = np.array(self.T_world_camera, dtype=float)
        return CameraMount(T, self.width, self.height, float(np.deg2rad(self.vertical_fov_deg)))


class _RegionEntry(_Strict):
    origin: Vec
    voxel_size: Annotated[Number, Field(ge=0.002, le=0.1)]
    shape: tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]]


class _RoomEntry(_Strict):
    center: tuple[Number, Number]
    size: tuple[Positive, Positive]
    height: Positive
    open_above: bool = True


class _WorkspaceFile(_Strict):
    format: Literal["torc-workspace/1"]
    name: Annotated[str, Field(pattern=r"^\w[\w .+-]{0,63}$")]
    table: _BoxEntry
    bin: _BinEntry
    camera: _CameraEntry
    region: _RegionEntry
    obstacles: list[_Obstacle] = []
    room: _RoomEntry | None = None

    @model_validator(mode="after")
    def _fits(self) -> "_WorkspaceFile":
        support = self.table.center[2] + self.table.size[2] / 2
        if abs(self.region.origin[2] - support) > _SUPPORT_TOLERANCE_M:
            raise ValueError(f"the region's floor must be the table's upper side, at z = {support:g}")
        if np.prod(self.region.shape) > _MAX_VOXELS:
            raise ValueError(f"the region has more than {_MAX_VOXELS:,} voxels; enlarge voxel_size")
        return self


@cache
def _shipped(name: str) -> Workspace:
    return _read(DATA / f"{name}.yaml")


def _read(path: Path) -> Workspace:
    remedy = f"Compare it with a shipped one: {EXAMPLE}."
    entry = read_yaml_as(_WorkspaceFile, path, "workspace", _MAX_BYTES, remedy)
    bin_, region, room = entry.bin, entry.region, entry.room
    workspace = Workspace(
        table=Box("table", entry.table.center, entry.table.size),
        bin=Bin(bin_.floor_center, bin_.inner_size, bin_.wall),
        camera=entry.camera.mount(),
        grid=VoxelGrid(np.array(region.origin), region.voxel_size, region.shape),
        drop_position=bin_.drop_position,
        obstacles=tuple(Box(o.name, o.center, o.size) for o in entry.obstacles),
        name=entry.name,
        # A file without a room reads as before rooms existed.
        source=fingerprint(entry.model_dump(exclude=set() if room else {"room"})),
        room=None if room is None else Room(room.center, room.size, room.height, room.open_above),
    )
    if found := "".join(f"\n  {fault}" for fault in _faults(workspace)):
        raise InputError(f"{path} is not a valid workspace file:{found}\n{remedy}")
    return workspace


def _faults(workspace: Workspace) -> Iterator[str]:
    """Yield mistakes, with the fields concerned: a camera that sees none of the table, a bin that misses its drops."""
    camera, bin_ = workspace.camera, workspace.bin
    (cx, cy, cz), (lx, ly, h), (x, y, z) = bin_.center, bin_.inner_size, workspace.drop_position
    if abs(x - cx) > lx / 2 or abs(y - cy) > ly / 2 or z < cz + h:
        yield "bin.drop_position: it is not above the bin's opening"
    if room := workspace.room:
        center, half = np.array(room.center), np.array(room.size) / 2
        low, high = workspace.grid.origin[:2], workspace.grid.upper[:2]
        if (center + half < low).any() or (center - half > high).any():
            yield "room: no part of it lies in the region; check room.center and room.size"
    eye = camera.T_world_camera[:3, 3]
    for box in (*workspace.static_boxes(), Box("bin", (cx, cy, cz + h / 2), bin_.inner_size)):
        if (np.abs(eye - np.array(box.center)) < np.array(box.size) / 2).all():
            yield f"camera.position: the camera is inside '{box.name}'; move it out"
            return
    floor = workspace.watched_table(_ACROSS)
    if eye[2] <= workspace.support_z_m:
        yield (
            f"camera.position: the camera is at z = {eye[2]:.2f} m, below the table's upper side at "
            f"{workspace.support_z_m:.2f} m; raise it"
        )
    elif len(floor) == 0:
        yield "region: no part of it lies over the table; check region.origin and table.center"
    elif (distance_m := np.linalg.norm(floor - eye, axis=1).min()) > _FARTHEST_M:
        yield f"camera.position: the camera is {distance_m:.1f} m from the table. Are these metres?"
    else:
        u, v, depth_m = project(floor, camera.K, camera.T_world_camera)
        across, along = (u > -0.5) & (u < camera.width - 0.5), (v > -0.5) & (v < camera.height - 0.5)
        seen = float(np.mean((depth_m > 0) & across & along))
        if seen < _LEAST_SEEN:
            yield (
                f"camera: it sees {seen:.0%} of the watched part of the table. Check camera.position, look_at (or "
                "T_world_camera: OpenCV axes, z forward) and vertical_fov_deg"
            )
