"""The robot file: what an MJCF does not say. Checked by pydantic; errors name the file, the field and the remedy."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from torc.io.strict_yaml import Number, read_yaml_as
from torc.robots.names import DATA

EXAMPLE = DATA / "sda10f_2f85" / "sda10f_2f85.yaml"
"""A shipped robot file, to compare with."""
MAX_BYTES = 256_000
Names = Annotated[list[str], Field(min_length=1)]
Positive = Annotated[Number, Field(gt=0.0)]
RobotName = Annotated[str, Field(pattern=r"^\w[\w .+-]{0,63}$")]
"""Short and printable: it appears in problem files and exported data."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ArmEntry(_Strict):
    """The arm: which joints, how fast, and where it rests."""

    joints: Names
    actuators: Names
    tool0_site: str
    speed_deg_s: Positive
    hardware_speed_deg_s: list[Positive]
    acceleration_deg_s2: Positive
    rest_qpos_rad: list[Number]

    @model_validator(mode="after")
    def _same_lengths(self) -> "ArmEntry":
        for name in ("actuators", "hardware_speed_deg_s", "rest_qpos_rad"):
            if (n := len(getattr(self, name))) != len(self.joints):
                raise ValueError(f"{name} has {n} entries for {len(self.joints)} joints")
        return self


class FingerEntry(_Strict):
    """One finger: its body, the site at its distal end, and the geoms that are pad and blade."""

    body: str
    tip_site: str
    pad_geoms: Names
    blade_geoms: list[str] = []


class GripperEntry(_Strict):
    """The gripper: one actuated joint, which every other gripper joint follows by an equality of the MJCF."""

    name: str
    body: str
    actuator: str
    driver_joint: str
    max_width_m: Positive
    fingers: Annotated[list[FingerEntry], Field(min_length=2, max_length=2)]


class SphereEntry(_Strict):
    """How finely the collision spheres cover the collision geoms."""

    tolerance_m: Positive = 0.005


class SelfCollisionEntry(_Strict):
    """What needs a check: pairs of moving bodies (None: all but neighbours), and what can touch the fixed parts."""

    pairs: list[tuple[str, str]] | None = None
    never_with_static: list[str] = []


class RobotFile(_Strict):
    """The whole file."""

    format: Literal["torc-robot/1"]
    name: RobotName
    mjcf: str
    arm: ArmEntry
    gripper: GripperEntry
    spheres: SphereEntry = SphereEntry()
    self_collision: SelfCollisionEntry = SelfCollisionEntry()


def read_robot_file(path: Path) -> RobotFile:
    """Read a robot file. Raises InputError that names file and field."""
    return read_yaml_as(RobotFile, path, "robot", MAX_BYTES, f"Compare it with a shipped one: {EXAMPLE}.")
