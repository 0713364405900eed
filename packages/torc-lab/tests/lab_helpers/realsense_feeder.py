"""A RealSense camera without hardware: librealsense's software device, fed with pictures of a test's own.

pyrealsense2 is imported when a camera is made, so that tests can skip where it is missing.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from torc.errors import CameraError

_PERIOD_MS = 33.0


class Lens(NamedTuple):
    """Intrinsics of a stream: fx = fy, the principal point in the middle unless given."""

    width: int
    height: int
    f: float
    model: str = "none"
    coefficients: Sequence[float] = (0, 0, 0, 0, 0)
    center: tuple[float, float] | None = None

    @property
    def K(self) -> np.ndarray:
        """Pixels, centres at integer coordinates."""
        cx, cy = self.center or ((self.width - 1) / 2, (self.height - 1) / 2)
        return np.array([[self.f, 0, cx], [0, self.f, cy], [0, 0, 1.0]])


class SoftwareRealSense:
    """Streams depth and colour, and two infrared ones if there is a baseline. As an opener of frames it is called with
    the camera's configuration and is then the source of them: every `wait` pushes the pictures once more.

    Attributes:
        pictures: "depth" (uint16), "color", "left", "right", to push at each wait; one that is missing is not pushed.
        log: what was done with it.
    """

    def __init__(
        self,
        depth: Lens,
        color: Lens,
        T_color_depth: np.ndarray,
        *,
        unit_m: float = 0.001,
        baseline_m: float = 0.0,
        infrared: Lens | None = None,
        format: str = "rgb8",
    ) -> None:
        import pyrealsense2 as rs

        self._rs, self._unit_m = rs, unit_m
        self.pictures: dict[str, np.ndarray] = {}
        self.log: list[str] = []
        self.configs: list[Any] = []
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, "Software D435")
        self.device.register_info(rs.camera_info.serial_number, "012345670123")
        stereo, rgb = self.device.add_sensor("Stereo Module"), self.device.add_sensor("RGB Camera")
        stereo.add_read_only_option(rs.option.depth_units, unit_m)
        self._sensors = {"depth": stereo, "left": stereo, "right": stereo, "color": rgb}
        of_left = infrared or depth
        kinds = {"depth": (rs.stream.depth, 0, 2, rs.format.z16, depth)}
        if baseline_m:
            kinds["left"] = (rs.stream.infrared, 1, 1, rs.format.y8, of_left)
            kinds["right"] = (rs.stream.infrared, 2, 1, rs.format.y8, of_left)
        kinds["color"] = (rs.stream.color, 0, 3, getattr(rs.format, format), color)
        self._bytes = {name: kind[2] for name, kind in kinds.items()}
        self._profiles = {
            name: self._sensors[name].add_video_stream(self._stream(uid, *kind))
            for uid, (name, kind) in enumerate(kinds.items())
        }
        self._register("depth", "color", T_color_depth)
        if baseline_m:
            T = np.eye(4)
            self._register("depth", "left", T)
            T = T.copy()
            T[0, 3] = -baseline_m
            self._register("left", "right", T)
        self.device.create_matcher(rs.matchers.default)
        self._count = 0
        self._syncer: Any = None

    def _stream(self, uid: int, kind: Any, index: int, size: int, form: Any, lens: Lens) -> Any:
        rs = self._rs
        intrinsics = rs.intrinsics()
        intrinsics.width, intrinsics.height = lens.width, lens.height
        intrinsics.fx = intrinsics.fy = lens.f
        intrinsics.ppx, intrinsics.ppy = lens.K[0, 2], lens.K[1, 2]
        intrinsics.model, intrinsics.coeffs = getattr(rs.distortion, lens.model), list(lens.coefficients)
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid, stream.fmt, stream.fps = kind, index, uid, form, 30
        stream.width, stream.height, stream.bpp = lens.width, lens.height, size
        stream.intrinsics = intrinsics
        return stream

    def _register(self, start: str, end: str, T_end_start: np.ndarray) -> None:
        extrinsics = self._rs.extrinsics()
        extrinsics.rotation = T_end_start[:3, :3].T.ravel().tolist()  # column-major
        extrinsics.translation = T_end_start[:3, 3].tolist()
        self._profiles[start].register_extrinsics_to(self._profiles[end], extrinsics)

    def __call__(self, config: Any) -> "SoftwareRealSense":
        """Opens it."""
        self.configs.append(config)
        self.log.append("open")
        self._syncer = self._rs.syncer()
        self._start(self._syncer)
        return self

    def _start(self, sink: Any) -> None:
        for sensor in {id(s): s for s in self._sensors.values()}.values():
            sensor.open([p for n, p in self._profiles.items() if self._sensors[n] is sensor])
            sensor.start(sink)

    def close(self) -> None:
        """Stops the streams."""
        self.log.append("close")
        for sensor in {id(s): s for s in self._sensors.values()}.values():
            sensor.stop()
            sensor.close()

    def wait(self) -> Any:
        """Pushes the pictures until the syncer has a set of them."""
        self.log.append("wait")
        if not self.pictures:
            raise CameraError("RealSense: no picture within 0 s (this one is told to give none)")
        for _ in range(4):
            self._push()
            frames = self._syncer.poll_for_frames()
            if frames and frames.size() == len(self.pictures):
                return frames
        raise AssertionError("The syncer gave no set.")

    def _push(self) -> None:
        self._count += 1
        for name, picture in self.pictures.items():
            frame = self._rs.software_video_frame()
            frame.pixels, frame.bpp = np.ascontiguousarray(picture), self._bytes[name]
            frame.stride = picture.shape[1] * self._bytes[name]
            frame.timestamp, frame.frame_number = self._count * _PERIOD_MS, self._count
            frame.domain = self._rs.timestamp_domain.hardware_clock
            frame.profile = self._profiles[name].as_video_stream_profile()
            if name == "depth":
                frame.depth_units = self._unit_m
            self._sensors[name].on_video_frame(frame)

    def record(self, path: Path, sets: int) -> None:
        """A recording of so many sets of pictures, as the recorder of librealsense writes it."""
        recorder = self._rs.recorder(str(path), self.device)
        sensors, syncer = recorder.query_sensors(), self._rs.syncer()
        for sensor in sensors:
            sensor.open(sensor.get_stream_profiles())
            sensor.start(syncer)
        for _ in range(sets):
            self._push()
        for sensor in sensors:
            sensor.stop()
            sensor.close()
