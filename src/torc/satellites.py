"""The packages beside torc in its repository: their commands and parts, and how to get them.

They register these by entry points, like any package, and nothing here imports them. The table serves only messages and
documentation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from torc.errors import MissingDependencyError, extra_remedy


@dataclass(frozen=True)
class Satellite:
    """A package beside torc in its repository.

    Attributes:
        package: its name in the index.
        extra: the extra of torc-retrieval that installs it.
        commands: names of its commands.
        parts: by `Kind.group` the names of its parts, each with the extra that installs all it needs.
    """

    package: str
    extra: str
    commands: tuple[str, ...]
    parts: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


SATELLITES = (
    Satellite(
        "torc-lab",
        "lab",
        ("lab", "retrieve", "camera"),
        {
            "torc.cameras": {"realsense": "realsense", "ros": "lab", "zed": "lab", "zed-uvc": "lab"},
            "torc.arm_drivers": {"motoman": "lab", "ros": "lab", "ur-rtde": "ur"},
            "torc.gripper_drivers": {"franka-hand": "lab", "robotiq-modbus": "lab", "robotiq-urcap": "lab"},
        },
    ),
    Satellite("torc-next-object", "next-object", ("next-object", "vlm-eval")),
    Satellite(
        "torc-networks",
        "networks",
        ("serve",),
        {
            "torc.perceptions": {"network": "networks", "grounded-sam2": "sam", "sam3": "sam"},
            "torc.depths": {"network": "networks"},
            "torc.grasp_planners": {"graspgenx": "networks", "contact-graspnet": "networks"},
            "torc.motion_planners": {"curobo": "networks"},
        },
    ),
)


def satellite_of_part(group: str, name: str) -> Satellite | None:
    """Return the satellite that brings the part of that name; None if none does."""
    return next((s for s in SATELLITES if name in s.parts.get(group, ())), None)


def satellite_of_command(name: str) -> Satellite | None:
    """Return the satellite that brings `torc NAME`; None if none does."""
    return next((s for s in SATELLITES if name in s.commands), None)


def not_installed(what: str, satellite: Satellite, extra: str = "") -> MissingDependencyError:
    """Return the error for something whose satellite is not installed; `what` begins its message."""
    return MissingDependencyError(
        f"{what} needs {satellite.package}, which", extra_remedy(extra or satellite.extra)
    )
