"""The camera `zed`: a ZED by the maker's SDK, which measures depth itself.

**This has not been run yet**: the SDK needs a CUDA device and a camera. It follows the documented Python interface
(https://www.stereolabs.com/docs/api/python/, SDK 4 and 5), and is tested against a double of it. The package pyzed on
PyPI is unrelated.
"""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from torc import InputError, Observation
from torc.errors import CameraError, MissingDependencyError
from torc.records import StereoPair
from torc.workspace.description import Workspace
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.lens import pinhole_matrix

_HOW = "the ZED SDK from https://www.stereolabs.com/developers/release, then its get_python_api.py in this environment"


@dataclass(frozen=True)
class ZedConfig:
    """A ZED with SDK.

    Attributes:
        serial: selects one if several are connected.
        file: a recording (.svo, .svo2) in place of a device.
        resolution: a name of sl.RESOLUTION: HD2K, HD1200, HD1080, HD720, SVGA, VGA.
        depth_mode: a name of sl.DEPTH_MODE: NEURAL, NEURAL_PLUS, ULTRA, PERFORMANCE and others.
        min_depth_m: nearest depth that is measured.
        pair: add both grey pictures, for another depth stage.
        warm_up: pictures to drop after opening.
        pose: the left camera's pose: level, workspace, 16 numbers or a file; see torc_lab.cameras.poses.
    """

    serial: int = 0
    file: str = ""
    resolution: str = "HD720"
    depth_mode: str = "NEURAL"
    min_depth_m: float = 0.3
    pair: bool = False
    warm_up: int = 15
    pose: str | tuple[float, ...] = "level"


def zed_library() -> Any:
    """Return pyzed.sl. Raises MissingDependencyError without it, and names the unrelated package if it is installed."""
    try:
        import pyzed.sl
    except ImportError as error:
        if find_spec("pyzed") is not None and "libsl_zed" not in str(error):
            raise MissingDependencyError(
                "The ZED SDK's Python interface (the installed package `pyzed` is another project's, of that name on "
                "PyPI, or damaged)",
                f"pip uninstall pyzed; then {_HOW}",
            ) from error
        raise MissingDependencyError("The ZED SDK's Python interface, pyzed.sl,", _HOW) from error
    return pyzed.sl


class ZedCamera(RealCamera):
    """A ZED, or a recording of one, with the depth that the SDK measures for its left picture."""

    what: ClassVar[str] = "ZED"

    @classmethod
    def check_library(cls) -> None:
        zed_library()

    @classmethod
    def devices(cls) -> list[str]:
        found = zed_library().Camera.get_device_list()
        return [f"{d.camera_model}, serial {d.serial_number}" for d in found]

    def __init__(self, config: ZedConfig | None = None, workspace: Workspace | None = None) -> None:
        self.config = ZedConfig() if config is None else config
        super().__init__(self.config.pose, workspace)
        self._sl: Any = None

    def _shoot(self) -> Observation:
        if self._device is None:
            self._open()
        sl, zed = self._sl, self._device
        for _ in range(1 if self.config.file else 2):  # the picture under way may have begun before the call
            self._grab()
        bgra, depth = sl.Mat(), sl.Mat()
        zed.retrieve_image(bgra, sl.VIEW.LEFT)
        zed.retrieve_measure(depth, sl.MEASURE.DEPTH)
        lenses = zed.get_camera_information().camera_configuration.calibration_parameters
        left = lenses.left_cam
        return Observation(
            rgb=np.ascontiguousarray(bgra.get_data()[..., 2::-1]),
            # Not a number: hidden from one camera; infinite: too near or too far.
            depth_m=np.array(depth.get_data(), np.float32),
            K=pinhole_matrix(left.fx, left.fy, left.cx, left.cy),
            T_world_camera=np.eye(4),
            qpos=np.zeros(0),
            stamp_s=zed.get_timestamp(sl.TIME_REFERENCE.IMAGE).get_milliseconds() / 1000,
            pair=self._pair(float(lenses.get_camera_baseline())) if self.config.pair else None,
        )

    def _open(self) -> None:
        c = self.config
        sl = self._sl = zed_library()
        wanted = sl.InitParameters()
        try:
            wanted.camera_resolution = getattr(sl.RESOLUTION, c.resolution)
            wanted.depth_mode = getattr(sl.DEPTH_MODE, c.depth_mode)
        except AttributeError:
            raise InputError(
                f"This version of the ZED SDK has no resolution '{c.resolution}', or no depth_mode '{c.depth_mode}'."
            ) from None
        wanted.coordinate_units = sl.UNIT.METER
        wanted.coordinate_system = sl.COORDINATE_SYSTEM.IMAGE  # x right, y down, z forward
        wanted.depth_minimum_distance = c.min_depth_m
        if c.file:
            wanted.set_from_svo_file(c.file)
        elif c.serial:
            wanted.set_from_serial_number(c.serial)
        zed = sl.Camera()
        found = zed.open(wanted)
        if found != sl.ERROR_CODE.SUCCESS:
            raise CameraError(
                f"ZED: it cannot be opened: {found}. Is it connected to a USB 3 port, and no other program using it? "
                "The SDK's ZED_Diagnostic tells more."
            )
        self._device = zed
        for _ in range(0 if c.file else c.warm_up):
            self._grab()

    def _grab(self) -> None:
        found = self._device.grab(self._sl.RuntimeParameters())
        if found != self._sl.ERROR_CODE.SUCCESS:
            gone = "the recording is at its end, or damaged" if self.config.file else "is it still connected?"
            raise CameraError(f"ZED: no picture: {found}; {gone}")

    def _pair(self, baseline_m: float) -> StereoPair:
        pictures = []
        for view in (self._sl.VIEW.LEFT_GRAY, self._sl.VIEW.RIGHT_GRAY):
            grey = self._sl.Mat()
            self._device.retrieve_image(grey, view)
            pixels = np.array(grey.get_data(), np.uint8)
            pictures.append(pixels.reshape(pixels.shape[:2]))
        return StereoPair(pictures[0], pictures[1], baseline_m)
