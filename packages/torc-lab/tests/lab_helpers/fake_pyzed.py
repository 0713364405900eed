"""A double of pyzed.sl, the ZED SDK's Python interface, as far as torc uses it.

Written after the SDK's documentation; the SDK itself has not been at hand.
"""

from enum import Enum, auto
from types import SimpleNamespace
from typing import Any

import numpy as np

ErrorCode = Enum("ErrorCode", "SUCCESS CAMERA_NOT_DETECTED END_OF_SVOFILE_REACHED")


class Mat:
    """A picture."""

    def __init__(self) -> None:
        self.data = np.zeros(0)

    def get_data(self) -> np.ndarray:
        """As an array."""
        return self.data


class InitParameters(SimpleNamespace):
    """What is wanted of a camera."""

    def set_from_serial_number(self, serial: int) -> None:
        self.serial = serial

    def set_from_svo_file(self, file: str) -> None:
        self.file = file


class FakeSl:
    """The module. Its cameras see `bgra`, `depth` (metres, with NaN and infinities) and the grey pictures, through a
    lens; they give so many pictures (`left`) and open with the code `opens`.
    """

    ERROR_CODE = ErrorCode
    RESOLUTION = SimpleNamespace(HD720="HD720", VGA="VGA")
    DEPTH_MODE = SimpleNamespace(NEURAL="NEURAL", ULTRA="ULTRA")
    UNIT = SimpleNamespace(METER="METER")
    COORDINATE_SYSTEM = SimpleNamespace(IMAGE="IMAGE")
    VIEW = Enum("VIEW", "LEFT LEFT_GRAY RIGHT_GRAY")
    MEASURE = SimpleNamespace(DEPTH=auto())
    TIME_REFERENCE = SimpleNamespace(IMAGE="IMAGE")
    InitParameters, RuntimeParameters, Mat = InitParameters, SimpleNamespace, Mat

    def __init__(self, rgb: np.ndarray, depth_m: np.ndarray, K: np.ndarray, baseline_m: float = 0.12) -> None:
        height, width = depth_m.shape
        self.bgra = np.dstack([rgb[..., ::-1], np.full((height, width), 255, np.uint8)])
        self.depth = depth_m
        self.grey = {self.VIEW.LEFT_GRAY: rgb[..., 0], self.VIEW.RIGHT_GRAY: rgb[..., 1]}
        self.left, self.opens = 100, ErrorCode.SUCCESS
        self.wanted: Any = None
        self.log: list[str] = []
        lens = SimpleNamespace(fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2])
        calibration = SimpleNamespace(left_cam=lens, get_camera_baseline=lambda: baseline_m)
        self.information = SimpleNamespace(
            camera_configuration=SimpleNamespace(calibration_parameters=calibration)
        )

    def Camera(self) -> "FakeSl":
        """The only camera is the module itself."""
        return self

    def open(self, wanted: InitParameters) -> ErrorCode:
        self.wanted = wanted
        self.log.append("open")
        return self.opens

    def grab(self, _: Any) -> ErrorCode:
        self.log.append("grab")
        self.left -= 1
        return ErrorCode.SUCCESS if self.left >= 0 else ErrorCode.END_OF_SVOFILE_REACHED

    def retrieve_image(self, mat: Mat, view: Any) -> None:
        mat.data = self.bgra if view is self.VIEW.LEFT else self.grey[view]

    def retrieve_measure(self, mat: Mat, _: Any) -> None:
        mat.data = self.depth

    def get_camera_information(self) -> Any:
        return self.information

    def get_timestamp(self, _: Any) -> Any:
        return SimpleNamespace(get_milliseconds=lambda: 1500)

    def close(self) -> None:
        self.log.append("close")
