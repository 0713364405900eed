"""The camera `zed-uvc`: a ZED on USB without the maker's SDK, used as a webcam that sends both pictures side by side.

It returns the left camera's colours and a stereo pair, rectified by the factory calibration, but no depth: the depth
stage computes it (`--depth sgbm`). ZED, ZED 2, ZED 2i and ZED Mini work; cameras with GMSL plugs do not.

The factory calibration, SN<serial>.conf, is an INI. Per resolution (2K, FHD, HD, VGA) it has the sections LEFT_CAM_HD
and RIGHT_CAM_HD with fx, fy, cx, cy in pixels and k1, k2, p1, p2, k3 in OpenCV's model; STEREO has Baseline, TY_HD and
TZ_HD (or TY, TZ) in millimetres, and the rotation vector RX_HD, CV_HD, RZ_HD. The maker's own calibration tool writes
Baseline, TY and TZ as -t_x, t_y and t_z of OpenCV's stereoCalibrate: a point p of the left camera is R p + t in the
right one's frame.
"""

import configparser
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from torc import InputError, Observation
from torc.errors import CameraError
from torc.io.reading import read_bytes
from torc.records import StereoPair
from torc.workspace.description import Workspace
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.lens import pinhole_matrix

SIZES = {"2K": (2208, 1242), "FHD": (1920, 1080), "HD": (1280, 720), "VGA": (672, 376)}
"""Width and height of one of the two pictures, by resolution."""
_MAX_BYTES = 100_000
_LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
_REMEDY = (
    "Fetch a complete one from https://calib.stereolabs.com/?SN=SERIAL, or calibrate the camera anew; what is missing "
    "is not taken for 0."
)
_BASELINES_MM = (20.0, 300.0)
_FEWEST_TRACKED = 30
_MOST_TURN = 0.2
"""Largest rotation between the two cameras, radians."""
Lens = tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "5"]]
"""Intrinsics, pixels, and k1, k2, p1, p2, k3."""
_VIDEO_DEVICES = Path("/sys/class/video4linux")
_WAITING = 5
"""Pictures that the driver may have buffered since the last call; they are dropped, and so is the one under way."""
_MOST_ROWS = 2.0
"""Most rows by which a point may differ in height between the rectified pictures."""
_PLACES = ("~/zed/settings", "/usr/local/zed/settings")
"""Where the maker's software keeps calibration files."""


@dataclass(frozen=True)
class ZedUvcConfig:
    """A ZED without SDK.

    Attributes:
        device: number of the video device, a path such as /dev/video2, or a film or numbered pictures of one.
        calibration: the camera's SN<serial>.conf; by default the only one in ~/zed/settings or /usr/local/zed/settings.
        resolution: 2K, FHD, HD or VGA.
        warm_up: pictures to drop after opening a device, while the exposure settles.
        pose: the rectified left camera's pose: level, workspace, 16 numbers or a file; see torc_lab.cameras.poses.
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
        """Whether this is a device, not a film."""
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
        """Store the configuration; `open_video` opens a cv2.VideoCapture with the first picture."""
        self.config = ZedUvcConfig() if config is None else config
        super().__init__(self.config.pose, workspace)
        self._open = open_video or _open_video
        self._rectifier: Rectifier | None = None

    def close(self) -> None:
        """Free the device; the next capture opens it again."""
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
        """Return the left and the right picture, blue first."""
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
    """Return the path of the calibration. Raises InputError if none is given and not exactly one is found."""
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
    """Open the device, set to both pictures side by side. Raises CameraError."""
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


def read_calibration(
    path: Path, resolution: str
) -> tuple[Lens, Lens, Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """Read the factory calibration for a resolution, one of SIZES.

    Returns:
        Both lenses, left first, then R_right_left and t_m (metres): p_right = R_right_left @ p_left + t_m.

    Raises:
        InputError: the file cannot be read, lacks a value, or holds impossible ones.
    """
    file = configparser.ConfigParser(interpolation=None, strict=False)

    def number(section: str, *names: str) -> float:
        """Return the value of the first of these keys that exists."""
        name = next((n for n in names if file.has_option(section, n)), names[0])
        found = float(re.split("[#;]", file.get(section, name))[0])
        if not np.isfinite(found):
            raise ValueError(f"{name} is {found}")
        return found

    try:
        content = read_bytes(path, _MAX_BYTES, "the calibration of a ZED (SN<serial>.conf)")
        file.read_string(content.decode("utf-8-sig"))
        lenses = [[number(f"{side}_CAM_{resolution}", k) for k in _LENS] for side in ("LEFT", "RIGHT")]
        baseline_mm = number("STEREO", "Baseline")
        across_mm = [number("STEREO", f"{k}_{resolution}", k) for k in ("TY", "TZ")]
        turn = np.array([number("STEREO", f"{k}_{resolution}") for k in ("RX", "CV", "RZ")])
    except (configparser.Error, ValueError) as error:
        raise InputError(f"{path} is no complete calibration of a ZED: {error}. {_REMEDY}") from error
    if not _BASELINES_MM[0] <= baseline_mm <= _BASELINES_MM[1]:
        raise InputError(f"{path}: a Baseline of {baseline_mm:g} mm cannot be. {_REMEDY}")
    if np.linalg.norm(turn) > _MOST_TURN:
        raise InputError(f"{path}: the cameras are turned by {np.linalg.norm(turn):.2f} rad. {_REMEDY}")
    width, height = SIZES[resolution]
    for fx, fy, cx, cy, *_ in lenses:
        if not (0.2 < fx / width < 3 and 0.8 < fy / fx < 1.25 and 0 < cx < width and 0 < cy < height):
            raise InputError(
                f"{path}: fx {fx:g}, fy {fy:g}, cx {cx:g}, cy {cy:g} do not fit pictures of {width}x{height} pixels. "
                f"{_REMEDY}"
            )
    left, right = ((pinhole_matrix(*lens[:4]), np.array(lens[4:])) for lens in lenses)
    return left, right, np.asarray(cv2.Rodrigues(turn)[0]), np.array([-baseline_mm, *across_mm]) / 1000


class Rectifier:
    """Rectifies both pictures, and removes the lenses' distortion.

    A point is then in the same row of both (Bouguet's method, as in OpenCV's stereoRectify).

    Attributes:
        K: intrinsics of both rectified pictures, pixels.
        baseline_m: distance between the cameras.
        R_rectified_left: rotates from the left camera's own frame to the rectified one.
    """

    def __init__(self, path: Path, resolution: str) -> None:
        """Compute the maps. Raises InputError as `read_calibration`."""
        (K_left, lens_left), (K_right, lens_right), R, t_m = read_calibration(path, resolution)
        size = SIZES[resolution]
        R_left, R_right, P_left, P_right, *_ = cv2.stereoRectify(
            *(K_left, lens_left, K_right, lens_right, size, R, t_m[:, None]),
            flags=cv2.CALIB_ZERO_DISPARITY,
            alpha=0,
        )
        self.K = np.array(P_left[:, :3], float)
        self.baseline_m = float(-P_right[0, 3] / P_right[0, 0])
        self.R_rectified_left = np.array(R_left, float)
        self._maps = (
            cv2.initUndistortRectifyMap(K_left, lens_left, R_left, P_left, size, cv2.CV_16SC2),
            cv2.initUndistortRectifyMap(K_right, lens_right, R_right, P_right, size, cv2.CV_16SC2),
        )

    def rectify(
        self, left: UInt8[np.ndarray, "h w *c"], right: UInt8[np.ndarray, "h w *c"]
    ) -> tuple[UInt8[np.ndarray, "h w *c"], UInt8[np.ndarray, "h w *c"]]:
        """Return both pictures rectified; they must have the calibration's size."""
        found = [cv2.remap(p, *maps, cv2.INTER_LINEAR) for p, maps in zip((left, right), self._maps)]
        return np.asarray(found[0], np.uint8), np.asarray(found[1], np.uint8)


def row_difference(left: UInt8[np.ndarray, "h w"], right: UInt8[np.ndarray, "h w"]) -> float | None:
    """Return the median row difference of points in two rectified grey pictures; None if too few points match.

    If it exceeds a pixel or two, the calibration belongs to another camera.
    """
    starts = cv2.goodFeaturesToTrack(left, 300, 0.01, 8)
    if starts is None:
        return None
    starts = np.asarray(starts)
    there, found = _tracked(left, right, starts)
    back, again = _tracked(right, left, there)
    good = found & again & (np.linalg.norm(back - starts, axis=-1).ravel() < 0.5)
    if np.count_nonzero(good) < _FEWEST_TRACKED:
        return None
    return float(np.median(np.abs(there - starts).reshape(-1, 2)[good, 1]))


def _tracked(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where points (n, 1, 2) of one picture are in another, and which were found (Lucas and Kanade 1981)."""
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        start, end, points, np.zeros_like(points), winSize=(21, 21), maxLevel=5
    )
    return np.asarray(there), np.asarray(found).ravel() > 0
