"""Read the lab file (`torc-lab/1`): robot, camera and drivers, how to reach them, and how the arm may move."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from torc import Conditions, InputError, load_robot, load_workspace
from torc.errors import UnknownNameError
from torc.io.reading import read_text
from torc.io.strict_yaml import Number, explain_faults, parse_plain_yaml
from torc.registry.kinds import ARM_DRIVERS, GRIPPER_DRIVERS, Kind
from torc.registry.loading import load_part
from torc.registry.settings import config_class
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc.workspace.description import Workspace
from torc_lab.checks import REDUCED_SPEED_M_S
from torc_lab.identity import check_settings

_MAX_BYTES = 100_000
_REMEDY = "`torc lab example NAME` prints one to begin with."
_AROUND_M = 0.3
"""Default room around table, bin and rest pose within which the arm may move."""
_BELOW_M, _ABOVE_M = 0.01, 1.3
"""Default room below table and bin, and above the table, as free motions swing high."""
_PATHS = {"pose", "path"}
"""Device settings that may name files or directories relative to the lab file."""
Vec = tuple[Number, Number, Number]


@dataclass(frozen=True)
class Device:
    """A driver and its settings."""

    driver: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Safety:
    """Limits on how the arm and the gripper may move.

    Attributes:
        speed: share of the robot's speed limits.
        tcp_speed_m_s: highest speed of the fingertips, whatever the share.
        margin_rad: distance to keep from the joint limits.
        box_lower, box_upper: corners of the box for flange, TCP, the arm from its elbow on, and a held object, world
            frame, metres.
        grip_force_n: force with which the gripper closes.
    """

    speed: float
    tcp_speed_m_s: float
    margin_rad: float
    box_lower: Float[np.ndarray, "3"]
    box_upper: Float[np.ndarray, "3"]
    grip_force_n: float


@dataclass(frozen=True)
class Lab:
    """A laboratory as its file describes it, with nothing connected yet.

    Attributes:
        conditions: the stages around the task planner, including the camera with its settings.
        held_joints: positions of joints that the robot description assumes fixed, radians, by name in ROS or as
            "group N" on a Motoman controller; in addition to those that torc knows of the shipped robots.
    """

    name: str
    path: Path
    robot: RobotDescription
    workspace: Workspace
    arm: Device
    gripper: Device
    safety: Safety
    conditions: Conditions
    held_joints: Mapping[str, float] = field(default_factory=dict)


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _DeviceEntry(BaseModel):
    model_config = ConfigDict(extra="allow", frozen=True)
    driver: str

    def device(self, here: Path) -> Device:
        settings = dict(self.model_extra or {})
        for name in _PATHS & settings.keys():
            there = Path.exists if name == "path" else Path.is_file
            with suppress(OSError):  # a text may be too long for a name
                if isinstance(value := settings[name], str) and value and there(here / value):
                    settings[name] = str(here / value)
        return Device(self.driver, settings)


class _BoxEntry(_Strict):
    lower: Vec
    upper: Vec

    @model_validator(mode="after")
    def _has_room(self) -> "_BoxEntry":
        if any(a >= b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError("each number of lower must be below that of upper")
        return self


class _SafetyEntry(_Strict):
    speed: Annotated[Number, Field(gt=0, le=1)] = 0.1
    tcp_speed_m_s: Annotated[Number, Field(gt=0, le=5)] = REDUCED_SPEED_M_S
    margin_deg: Annotated[Number, Field(ge=0, le=45)] = 1.0
    box: _BoxEntry | None = None
    grip_force_n: Annotated[Number, Field(gt=0, le=500)] = 50.0


class _LabFile(_Strict):
    format: Literal["torc-lab/1"]
    name: Annotated[str, Field(pattern=r"^\w[\w .+-]{0,63}$")]
    robot: str = Conditions().robot
    workspace: str = Conditions().workspace
    arm: _DeviceEntry
    gripper: _DeviceEntry
    camera: _DeviceEntry
    pipeline: dict[str, Any] = {}
    safety: _SafetyEntry = _SafetyEntry()
    held_joints: dict[str, Number] = {}


def load_lab(path: Path) -> Lab:
    """Load a lab file; files that it names may be relative to it. Raises InputError if anything is not valid."""
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Cannot read the lab file {path}: {error}. {_REMEDY}") from None
    content = parse_plain_yaml(text, str(path), "lab", _MAX_BYTES, _REMEDY)
    try:
        entry = _LabFile.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{path} is no valid lab file:\n{explain_faults(error)}\n{_REMEDY}") from None
    return _lab(entry, path)


def _lab(entry: _LabFile, path: Path) -> Lab:
    here = path.parent
    robot_name, workspace_name = _beside(here, entry.robot), _beside(here, entry.workspace)
    robot, workspace = load_robot(robot_name), load_workspace(workspace_name)
    arm, gripper, camera = (e.device(here) for e in (entry.arm, entry.gripper, entry.camera))
    for kind, device, where in ((ARM_DRIVERS, arm, "arm"), (GRIPPER_DRIVERS, gripper, "gripper")):
        driver_config(kind, device, f"{path}: {where}")
    check_settings(robot.arm, arm.settings, f"{path}: arm")
    return Lab(
        entry.name,
        path,
        robot,
        workspace,
        arm,
        gripper,
        _safety(entry.safety, robot, workspace),
        _conditions(entry.pipeline, robot_name, workspace_name, camera, path),
        entry.held_joints,
    )


def _conditions(
    pipeline: Mapping[str, Any], robot: str, workspace: str, camera: Device, path: Path
) -> Conditions:
    known = {f.name for f in fields(Conditions)} - {"robot", "workspace", "camera", "noise", "friction"}
    for name in pipeline:
        if name not in known:
            raise UnknownNameError(f"{path}: stage in pipeline", name, sorted(known))
    told = dict(pipeline)
    settings = {**told.pop("settings", {}), **{f"camera.{k}": v for k, v in camera.settings.items()}}
    around = {"robot": robot, "workspace": workspace, "camera": camera.driver, "settings": settings}
    try:
        return TypeAdapter(Conditions).validate_python({"perception": "embedded", **told, **around})
    except ValidationError as error:
        raise InputError(f"{path}: pipeline:\n{explain_faults(error)}") from None


def _safety(entry: _SafetyEntry, robot: RobotDescription, workspace: Workspace) -> Safety:
    lower, upper = usual_box(robot, workspace)
    if entry.box is not None:
        lower, upper = np.array(entry.box.lower), np.array(entry.box.upper)
    margin_rad = float(np.deg2rad(entry.margin_deg))
    return Safety(entry.speed, entry.tcp_speed_m_s, margin_rad, lower, upper, entry.grip_force_n)


def usual_box(
    robot: RobotDescription, workspace: Workspace
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the default box's corners (world frame, metres), around table, bin, obstacles and the arm at rest."""
    corners = [
        np.array(b.center) + s * np.array(b.size) / 2 for b in workspace.static_boxes() for s in (-1, 1)
    ]
    flange = tool0_poses(robot.arm, robot.arm.rest_qpos[None])[0]
    places = np.array([*corners, flange[:3, 3], (flange @ robot.gripper.T_tool0_tcp(0.0))[:3, 3]])
    lower, upper = places.min(axis=0) - _AROUND_M, places.max(axis=0) + _AROUND_M
    lower[2] = min(workspace.support_z_m, workspace.bin.center[2]) - _BELOW_M
    upper[2] = max(upper[2], workspace.support_z_m + _ABOVE_M)
    return lower, upper


def driver_config(kind: Kind[Any], device: Device, where: str) -> dict[str, Any]:
    """Return the arguments to construct a driver with: one `config` if it takes such a dataclass, else its settings.

    Args:
        kind: arm or gripper drivers.
        where: names the place in the lab file, for messages.

    Raises:
        InputError: the driver or a setting is unknown, or a value is not valid.
    """
    made_with = config_class(load_part(kind, device.driver))
    if made_with is None:
        return dict(device.settings)
    known = [f.name for f in fields(made_with)]
    for name in device.settings:
        if name not in known:
            raise UnknownNameError(f"{where}: setting", name, known, lister=f"torc settings {device.driver}")
    try:
        return {"config": TypeAdapter(made_with).validate_python(dict(device.settings))}
    except ValidationError as error:
        raise InputError(f"{where}:\n{explain_faults(error)}") from None


def example_labs() -> dict[str, str]:
    """Return the example lab files by name; users copy one and change the addresses."""
    folder = files("torc_lab") / "data"
    return {
        p.name.removesuffix(".yaml"): p.read_text(encoding="utf-8")
        for p in sorted(folder.iterdir(), key=lambda p: p.name)
        if p.name.endswith(".yaml")
    }


def _beside(here: Path, name: str) -> str:
    """Return the path of the file of that name beside the lab file, or the name if no such file exists."""
    return str(here / name) if (here / name).is_file() else name
