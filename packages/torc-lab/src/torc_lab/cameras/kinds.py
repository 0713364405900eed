"""List the kinds of camera, their missing libraries and the connected devices; open one of them."""

from dataclasses import dataclass
from typing import Any

from torc import Conditions, InputError, TorcError, load_workspace
from torc.registry.context import BuildContext
from torc.registry.kinds import CAMERAS
from torc.registry.loading import load_part, make_part, part_lines
from torc.registry.settings import under

SIMULATED = "simulated"


@dataclass(frozen=True)
class CameraKind:
    """A kind of camera.

    Attributes:
        what: description for people.
        missing: the library that is not installed and how to get it; "" if nothing is missing.
        devices: the connected ones; None if they cannot be listed.
    """

    name: str
    what: str
    missing: str
    devices: tuple[str, ...] | None


def camera_kinds() -> list[CameraKind]:
    """Return all kinds: those that come with torc, and those of installed packages."""
    kinds = []
    for name, what in part_lines(CAMERAS).items():
        if name == SIMULATED:
            continue
        try:
            camera = CAMERAS.traits(load_part(CAMERAS, name))
            camera.check_library()
            found = camera.devices()
            kinds.append(CameraKind(name, what, "", None if found is None else tuple(found)))
        except (TorcError, OSError, RuntimeError) as error:
            kinds.append(CameraKind(name, what, str(error), None))
    return kinds


def open_camera(conditions: Conditions) -> Any:
    """Return the camera of these conditions, with its settings; the device is opened with the first picture.

    Raises InputError if the camera is unknown or needs the simulation, or if it does not have one of the settings.
    """
    name = conditions.camera
    if name == SIMULATED:
        raise InputError(
            "The simulated camera sees only the simulation: `torc run` looks through it. Choose one that `torc camera "
            "list` shows, or your own as module:Class or path/to/file.py:Class."
        )
    context = BuildContext(workspace=load_workspace(conditions.workspace))
    return make_part(CAMERAS, name, under(conditions.settings, "camera"), context)
