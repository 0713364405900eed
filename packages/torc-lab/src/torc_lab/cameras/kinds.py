"""Which cameras torc knows, which libraries of theirs are missing, and which devices are connected."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from torc.errors import InputError, MissingDependencyError, TorcError, extra_remedy
from torc.plugins import load_part, make_part, part_paths
from torc.specs.conditions import Conditions
from torc.specs.settings import arguments, under
from torc.stages import CAMERAS
from torc.workspace.files import load_workspace
from torc_lab.cameras.realsense_device import realsense_devices, realsense_library
from torc_lab.cameras.zed_sdk import zed_library

_VIDEO_DEVICES = Path("/sys/class/video4linux")
SIMULATED = "simulated"


@dataclass(frozen=True)
class CameraKind:
    """A kind of camera.

    Attributes:
        what: in words.
        missing: what is not installed and how to get it; "" where nothing is missing.
        devices: what is connected; None where nobody can tell.
    """

    name: str
    what: str
    missing: str
    devices: tuple[str, ...] | None


_Probe = Callable[[], object]


def camera_kinds() -> list[CameraKind]:
    """All kinds: those that come with torc, and those of installed packages."""
    kinds = [_probed(*known) for known in _KNOWN]
    own = sorted(set(part_paths(CAMERAS)) - {SIMULATED, *(k.name for k in kinds)})
    return kinds + [CameraKind(name, "of an installed package", "", None) for name in own]


def open_camera(conditions: Conditions) -> Any:
    """The camera of these conditions, with its settings; nothing is opened before its first picture.

    Raises InputError for one that there is not, or that needs the simulation, and for settings that it has not.
    """
    name = conditions.camera
    if name == SIMULATED:
        raise InputError(
            "The simulated camera sees only the simulation: `torc run` looks through it. Choose one that `torc camera "
            "list` shows, or your own as module:Class or path/to/file.py:Class."
        )
    part = load_part(CAMERAS, name)
    given = arguments(part, under(conditions.settings, "camera"), "camera")
    return make_part(CAMERAS, name, given, {"workspace": load_workspace(conditions.workspace)})


def video_devices() -> list[str]:
    """Path and name of each video device of Linux; a camera may have several."""
    found = sorted(_VIDEO_DEVICES.glob("video*"), key=lambda p: int(p.name.removeprefix("video") or 0))
    return [f"/dev/{p.name}: {(p / 'name').read_text(errors='replace').strip()}" for p in found]


def _probed(
    name: str, what: str, library: _Probe | None, devices: Callable[[], list[str]] | None
) -> CameraKind:
    try:
        if library is not None:
            library()
        return CameraKind(name, what, "", None if devices is None else tuple(devices()))
    except (TorcError, OSError, RuntimeError) as error:
        return CameraKind(name, what, str(error), None if devices is None else ())


def _websockets() -> None:
    if find_spec("websockets") is None:
        raise MissingDependencyError("websockets, for rosbridge,", extra_remedy("lab"))


def _zed_devices() -> list[str]:
    found = zed_library().Camera.get_device_list()
    return [f"{d.camera_model}, serial {d.serial_number}" for d in found]


_KNOWN: tuple[tuple[str, str, _Probe | None, Callable[[], list[str]] | None], ...] = (
    (
        "realsense",
        "Intel RealSense D400 and kin: colour, depth, infrared pair",
        realsense_library,
        realsense_devices,
    ),
    (
        "zed-uvc",
        "Stereolabs ZED on USB, without its SDK: colour and stereo pair",
        None,
        video_devices,
    ),
    (
        "zed",
        "Stereolabs ZED by its SDK: colour, depth, pair (not run yet)",
        zed_library,
        _zed_devices,
    ),
    ("ros", "image topics of ROS 1 or 2, by rosbridge", _websockets, None),
    ("recorded", "frames from disk, as torc camera record writes them", None, None),
)
"""Name, what it is, what raises MissingDependencyError without its library, what lists devices."""
