"""The camera `zed-uvc`: a ZED on USB without the maker's SDK, as the webcam that it is: both pictures side by side.

It gives colour of the left camera and a stereo pair, rectified by the factory calibration, and no depth: that is for
the depth stage (`--depth sgbm`). ZED, ZED 2, ZED 2i and ZED Mini are such cameras; those with GMSL plugs are not.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
from jaxtyping import UInt8

from torc import InputError, Observation
from torc.errors import CameraError
from torc.records import StereoPair
from torc.workspace.description import Workspace
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.zed_calibration import SIZES, Rectifier, row_difference

_VIDEO_DEVICES = Path("/sys/class/video4linux")
_WAITING = 5
"""Pictures that the driver may have kept since the last call; they are dropped, and the one under way."""
_MOST_ROWS = 2.0
"""By which the same point may be higher in one rectified picture than in the other."""
_PLACES = ("~/zed/settings", "/usr/local/zed/settings")
"""Where the maker's software keeps calibration files."""


@dataclass(frozen=True)
class ZedUvcConfig:
    """A ZED without SDK.

    Attributes:
        device: number of the video device, a path such as /dev/video2, or a film or numbered pictures of one.
        calibration: the camera's SN<serial>.conf; if none is given, the only one that is found in ~/zed/settings or
            /usr/local/zed/settings.
        resolution: 2K, FHD, HD or VGA.
        warm_up: pictures to drop after opening a device, while the exposure settles.
        pose: where the rectified left camera is: level, workspace, 16 numbers or a file; see torc_lab.cameras.poses.
    """

    device: int | str = 0
    calibration: str = ""
    resolution: str = "HD"
    warm_up: int = 15
    pose: str | tuple[float, ...] = "level"

    def __post_init__(self) -> None:
        if self.resolution not in SIZES:
            raise InputError(f"ZedUvcConfig.resolution is '{self.resolution}': choose {', '.join(SIZES)}.")

    @property
    def live(self) -> bool:
        """Whether it is a device, not a film."""
        return isinstance(self.device, int) or self.device.startswith("/dev/")


class ZedUvcCamera(RealCamera):
    """A ZED by OpenCV's video capture."""

    what: ClassVar[str] = "ZED"

    @classmethod
    def devices(cls) -> list[str]:
        """Return path and name of each video device of Linux; a camera may have several."""
        found = sorted(_VIDEO_DEVICES.glob("video*"), key=lambda p: int(p.name.removeprefix("video") or 0))
        return [f"/dev/{p.name}: {(p / 'name').read_text(errors='replace').strip()}" for p in found]

    def __init__(
        self,
        config: ZedUvcConfig | None = None,
        workspace: Workspace | None = None,
        open_video: Callable[[ZedUvcConfig], Any] | None = None,
    ) -> None:
        """`open_video` gives a cv2.VideoCapture."""
        self.config = ZedUvcConfig() if config is None else config
        super().__init__(self.config.pose, workspace)
        self._open = open_video or _open_video
        self._rectifier: Rectifier | None = None

    def close(self) -> None:
        """Frees the device; the next capture opens it again."""
        video, self._device = self._device, None
        if video is not None:
            video.release()

    def _shoot(self) -> Observation:
        c = self.config
        if self._rectifier is None:
            self._rectifier = Rectifier(find_calibration(c.calibration), c.resolution)
        opened = self._device is None
        if opened:
            self._device = self._open(c)
        old = c.warm_up if opened else _WAITING
        for _ in range(old if c.live else 0):
            self._device.grab()
        left, right = self._rectifier.rectify(*self._halves())
        grey = [np.asarray(cv2.cvtColor(p, cv2.COLOR_BGR2GRAY), np.uint8) for p in (left, right)]
        apart = row_difference(*grey) if opened else None
        if apart is not None and apart > _MOST_ROWS:
            raise InputError(
                f"The ZED's two pictures do not fit together: the same points are {apart:.1f} rows apart. Is the "
                "calibration this camera's (its serial number is in the file's name)? Else calibrate it anew."
            )
        return Observation(
            rgb=np.ascontiguousarray(left[..., ::-1]),
            depth_m=np.zeros(left.shape[:2], np.float32),
            K=self._rectifier.K,
            T_world_camera=np.eye(4),
            qpos=np.zeros(0),
            stamp_s=time.time(),
            pair=StereoPair(grey[0], grey[1], self._rectifier.baseline_m),
        )

    def _halves(self) -> tuple[UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w 3"]]:
        """The left and the right picture, blue first."""
        good, picture = self._device.read()
        if not good or picture is None:
            gone = (
                "Is it still connected, to a USB 3 port?" if self.config.live else "The film is at its end."
            )
            raise CameraError(f"{self.what}: device {self.config.device} gave no picture. {gone}")
        width, height = SIZES[self.config.resolution]
        if picture.shape != (height, 2 * width, 3):
            raise CameraError(
                f"{self.what}: device {self.config.device} gave a picture of shape {picture.shape}; a ZED gives both "
                f"pictures side by side, {2 * width}x{height} pixels at resolution {self.config.resolution}. Choose "
                "another --camera.device (`torc camera list`), or --camera.resolution."
            )
        return np.ascontiguousarray(picture[:, :width]), np.ascontiguousarray(picture[:, width:])


def find_calibration(given: str) -> Path:
    """The calibration file. Raises InputError if none is given, and none or several are found."""
    if given:
        return Path(given).expanduser()
    found = sorted({p for place in _PLACES for p in Path(place).expanduser().glob("SN*.conf")})
    if len(found) != 1:
        several = f"{len(found)} were found: {', '.join(map(str, found))}." if found else "None was found."
        raise InputError(
            f"Which factory calibration is the ZED's? {several} Give --camera.calibration SN<serial>.conf; "
            "https://calib.stereolabs.com/?SN=<serial> has it."
        )
    return found[0]


def _open_video(config: ZedUvcConfig) -> cv2.VideoCapture:
    """The device, set to both pictures side by side. Raises CameraError."""
    video = cv2.VideoCapture(config.device)
    if not video.isOpened():
        raise CameraError(
            f"ZED: there is no video device {config.device}, or it is in use, or you may not read it (on Debian: be in "
            "the group `video`). `torc camera list` shows what is connected."
        )
    width, height = SIZES[config.resolution]
    if config.live:
        video.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"YUYV"))
        video.set(cv2.CAP_PROP_FRAME_WIDTH, 2 * width)
        video.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
        video.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    return video
