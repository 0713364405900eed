"""Opening a RealSense device, or a recording of one: all of the camera that software devices do without."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from torc import InputError
from torc.errors import CameraError, MissingDependencyError, extra_remedy

_WAITING = 16
"""Sets of pictures that may have waited since the last call."""


@dataclass(frozen=True)
class RealSenseConfig:
    """A RealSense camera.

    Attributes:
        serial: which one, if several are connected (`torc camera list`).
        file: a recording (.bag, .db3) in place of a device.
        width, height, fps: of all streams, pixels and pictures per second; of a recording those that it has.
        infrared: the stereo pair too, and everything in the left infrared camera's frame.
        warm_up: pictures to drop after opening, while the exposure settles; none of a recording.
        timeout_s: how long to wait for a picture.
        pose: where the camera is: level, workspace, 16 numbers or a file; see torc_lab.cameras.poses.
    """

    serial: str | int = ""
    file: str = ""
    width: int = 640
    height: int = 480
    fps: int = 30
    infrared: bool = False
    warm_up: int = 15
    timeout_s: float = 5.0
    pose: str | tuple[float, ...] = "level"

    def __post_init__(self) -> None:
        if min(self.width, self.height, self.fps) < 1 or self.warm_up < 0 or not self.timeout_s > 0:
            raise InputError(
                "RealSenseConfig: width, height, fps and timeout_s must be above 0, warm_up at least 0."
            )


class FrameSets(Protocol):
    """Where sets of pictures of one moment come from: a device, a recording, or a software device."""

    def wait(self) -> Any:
        """The next set (an `rs.composite_frame`) that was taken after this call. Raises CameraError if none comes."""

    def close(self) -> None:
        """Frees the device."""


Opener = Callable[[RealSenseConfig], FrameSets]


def realsense_library() -> Any:
    """pyrealsense2. Raises MissingDependencyError where it cannot be imported."""
    try:
        import pyrealsense2
    except ImportError as error:
        what, remedy = "pyrealsense2, for RealSense cameras,", extra_remedy("realsense")
        if "libusb" in str(error):
            what, remedy = "libusb, which pyrealsense2 needs,", "apt-get install libusb-1.0-0"
        raise MissingDependencyError(what, remedy) from error
    return pyrealsense2


def realsense_devices() -> list[str]:
    """Name and serial number of each connected camera. Raises MissingDependencyError."""
    rs = realsense_library()
    facts = rs.camera_info.name, rs.camera_info.serial_number
    return [", serial ".join(d.get_info(f) for f in facts) for d in rs.context().query_devices()]


class PipelineFrames:
    """The streams of a device or a recording."""

    def __init__(self, config: RealSenseConfig) -> None:
        """Starts the streams. Raises CameraError, MissingDependencyError."""
        rs = realsense_library()
        self._config, self._pipeline, wanted = config, rs.pipeline(), rs.config()
        if config.file:
            if not Path(config.file).is_file():
                raise CameraError(
                    f"There is no recording '{config.file}'. Give --camera.file a .bag or .db3."
                )
            wanted.enable_device_from_file(config.file, repeat_playback=False)
        else:
            if not realsense_devices():  # the library would wait a quarter of a minute for one
                raise CameraError(
                    "RealSense: no camera is connected. Plug it into a USB 3 port; a user without root needs "
                    "librealsense's udev rules for it."
                )
            self._ask_for(wanted, rs)
        try:
            if config.file:
                # As fast as pictures are asked for. Under load librealsense may leave out the first ones.
                profile = wanted.resolve(rs.pipeline_wrapper(self._pipeline))
                profile.get_device().as_playback().set_real_time(False)
            self._pipeline.start(wanted)
        except RuntimeError as error:
            raise CameraError(self._explained(str(error))) from error

    def _ask_for(self, wanted: Any, rs: Any) -> None:
        c = self._config
        if c.serial:
            wanted.enable_device(str(c.serial))
        wanted.enable_stream(rs.stream.color, c.width, c.height, rs.format.rgb8, c.fps)
        wanted.enable_stream(rs.stream.depth, c.width, c.height, rs.format.z16, c.fps)
        for index in (1, 2) if c.infrared else ():
            wanted.enable_stream(rs.stream.infrared, index, c.width, c.height, rs.format.y8, c.fps)

    def wait(self) -> Any:
        """The next set of pictures; of a device the first whose exposure began after the call."""
        try:
            if not self._config.file:
                for _ in range(_WAITING):
                    if not self._pipeline.poll_for_frames():
                        break
                # The one under way may have begun before.
                self._next()
            return self._next()
        except RuntimeError as error:
            ended = "the recording is at its end, or lacks a stream"
            gone = "is the camera still connected, by a USB 3 cable?"
            raise CameraError(
                f"RealSense: no picture within {self._config.timeout_s:g} s: {ended if self._config.file else gone} "
                f"({error})"
            ) from error

    def _next(self) -> Any:
        return self._pipeline.wait_for_frames(max(1, round(1000 * self._config.timeout_s)))

    def close(self) -> None:
        """Stops the streams."""
        with suppress(RuntimeError):  # it was unplugged
            self._pipeline.stop()

    def _explained(self, error: str) -> str:
        """What went wrong at the start, and what to do."""
        c = self._config
        if c.file:
            return f"RealSense: '{c.file}' is no recording that can be read: {error}"
        found = realsense_devices()
        named = f"Connected are: {'; '.join(found)}."
        if c.serial and not any(str(c.serial) in f for f in found):
            return f"RealSense: there is no camera with serial number {c.serial}. {named}"
        return (
            f"RealSense: the streams cannot be opened: {error}. {named} {c.width}x{c.height} at {c.fps} per second may "
            "be more than the camera or its USB port has: change --camera.width, --camera.height or --camera.fps. Or "
            "another program uses the camera."
        )
