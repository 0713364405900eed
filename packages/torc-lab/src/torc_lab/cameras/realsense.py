"""The camera `realsense`: Intel RealSense D400 and its kin, by pyrealsense2.

Depth is registered to the colour picture (torc_lab.cameras.registration), so both belong to the colour camera. The
lens's distortion is removed; intrinsics, extrinsics and the unit of depth come from the device. With `infrared`,
everything belongs to the left infrared camera instead, in which depth is measured. The observation then holds both
infrared pictures, which `--depth sgbm` can match, and colour is missing wherever depth is.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float, UInt8

from torc import InputError, Observation
from torc.errors import CameraError, MissingDependencyError, extra_remedy
from torc.geometry.transforms import make_pose
from torc.records import StereoPair
from torc.workspace.description import Workspace
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.lens import PinholeMap, pinhole_map, pinhole_matrix
from torc_lab.cameras.registration import registered_colors, registered_depth

_WAITING = 16
"""Sets of pictures that may have queued up since the last call."""
_MOST_SETS = 30
"""Sets of pictures in a row that may lack a stream."""
_SAME_PX = 0.5
"""The left infrared picture must have depth's intrinsics, within this."""


@dataclass(frozen=True)
class RealSenseConfig:
    """A RealSense camera.

    Attributes:
        serial: selects one if several are connected (`torc camera list`).
        file: a recording (.bag, .db3) in place of a device.
        width, height, fps: of all streams, pixels and pictures per second; a recording keeps its own.
        infrared: add the stereo pair, and use the left infrared camera's frame for everything.
        warm_up: pictures to drop after opening a device, while the exposure settles; none are dropped from a recording.
        timeout_s: how long to wait for a picture.
        pose: the camera's pose: level, workspace, 16 numbers or a file; see torc_lab.cameras.poses.
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


def realsense_library() -> Any:
    """Return pyrealsense2. Raises MissingDependencyError if it cannot be imported."""
    try:
        import pyrealsense2
    except ImportError as error:
        what, remedy = "pyrealsense2, for RealSense cameras,", extra_remedy("realsense")
        if "libusb" in str(error):
            what, remedy = "libusb, which pyrealsense2 needs,", "apt-get install libusb-1.0-0"
        raise MissingDependencyError(what, remedy) from error
    return pyrealsense2


class PipelineFrames:
    """The streams of a device or a recording: the part of the camera that software devices replace."""

    def __init__(self, config: RealSenseConfig) -> None:
        """Start the streams. Raises CameraError, MissingDependencyError."""
        rs, c = realsense_library(), config
        self._config, self._pipeline, wanted = config, rs.pipeline(), rs.config()
        if config.file and not Path(config.file).is_file():
            raise CameraError(f"There is no recording '{config.file}'. Give --camera.file a .bag or .db3.")
        if not config.file and not RealSenseCamera.devices():  # librealsense would wait a quarter of a minute
            raise CameraError(
                "RealSense: no camera is connected. Plug it into a USB 3 port; a user without root needs "
                "librealsense's udev rules for it."
            )
        try:
            if config.file:
                wanted.enable_device_from_file(config.file, repeat_playback=False)
                # As fast as pictures are asked for. Under load librealsense may leave out the first ones.
                profile = wanted.resolve(rs.pipeline_wrapper(self._pipeline))
                profile.get_device().as_playback().set_real_time(False)
            else:
                if c.serial:
                    wanted.enable_device(str(c.serial))
                wanted.enable_stream(rs.stream.color, c.width, c.height, rs.format.rgb8, c.fps)
                wanted.enable_stream(rs.stream.depth, c.width, c.height, rs.format.z16, c.fps)
                for index in (1, 2) if c.infrared else ():
                    wanted.enable_stream(rs.stream.infrared, index, c.width, c.height, rs.format.y8, c.fps)
            self._pipeline.start(wanted)
        except RuntimeError as error:
            if c.file:
                raise CameraError(
                    f"RealSense: '{c.file}' is no recording that can be read: {error}"
                ) from error
            connected = "; ".join(RealSenseCamera.devices())
            raise CameraError(
                f"RealSense: the streams cannot be opened: {error}. Connected are: {connected}. Is --camera.serial one "
                f"of these? {c.width}x{c.height} at {c.fps} per second may be more than the camera or its USB port "
                "has: change --camera.width, --camera.height or --camera.fps. Or another program uses the camera."
            ) from error

    def wait(self) -> Any:
        """Return the next set of pictures, an `rs.composite_frame`. Raises CameraError if none comes.

        From a device it is the first set whose exposure began after the call.
        """
        timeout_ms = max(1, round(1000 * self._config.timeout_s))
        try:
            if not self._config.file:
                for _ in range(_WAITING):
                    if not self._pipeline.poll_for_frames():
                        break
                # The one under way may have begun before.
                self._pipeline.wait_for_frames(timeout_ms)
            return self._pipeline.wait_for_frames(timeout_ms)
        except RuntimeError as error:
            ended = "the recording is at its end, or lacks a stream"
            gone = "is the camera still connected, by a USB 3 cable?"
            raise CameraError(
                f"RealSense: no picture within {self._config.timeout_s:g} s: {ended if self._config.file else gone} "
                f"({error})"
            ) from error

    def close(self) -> None:
        """Stop the streams."""
        with suppress(RuntimeError):  # it was unplugged
            self._pipeline.stop()


class RealSenseCamera(RealCamera):
    """A RealSense camera, or a recording of one."""

    what: ClassVar[str] = "RealSense"

    @classmethod
    def check_library(cls) -> None:
        realsense_library()

    @classmethod
    def devices(cls) -> list[str]:
        """Return name and serial number of each connected camera."""
        rs = realsense_library()
        facts = rs.camera_info.name, rs.camera_info.serial_number
        return [", serial ".join(d.get_info(f) for f in facts) for d in rs.context().query_devices()]

    def __init__(
        self,
        config: RealSenseConfig | None = None,
        workspace: Workspace | None = None,
        open_frames: Callable[[RealSenseConfig], PipelineFrames] = PipelineFrames,
    ) -> None:
        """Store the configuration; `open_frames` opens the device with the first picture."""
        self.config = RealSenseConfig() if config is None else config
        super().__init__(self.config.pose, workspace)
        self._open = open_frames
        self._lenses: dict[str, PinholeMap | None] = {}

    def _shoot(self) -> Observation:
        if self._device is None:
            self._device = self._open(self.config)
            for _ in range(0 if self.config.file else self.config.warm_up):
                self._device.wait()
        return self._observation(self._complete(self._device))

    def _complete(self, source: PipelineFrames) -> Any:
        """Return the next set with all streams: the first sets after opening may lack some."""
        missing = [""]
        for _ in range(_MOST_SETS):
            frames = source.wait()
            found = {"colour": frames.get_color_frame(), "depth": frames.get_depth_frame()}
            if self.config.infrared:
                found |= {f"infrared {i}": frames.get_infrared_frame(i) for i in (1, 2)}
            missing = [name for name, frame in found.items() if not frame]
            if not missing:
                return frames
        raise CameraError(
            f"RealSense: its pictures lack {', '.join(missing)}. Choose a camera, or a recording, with these streams"
            f"{', or leave out --camera.infrared' if self.config.infrared else ''}."
        )

    def _observation(self, frames: Any) -> Observation:
        color, depth = frames.get_color_frame(), frames.get_depth_frame()
        unit_m = float(depth.get_units())
        if not 1e-6 <= unit_m <= 0.1:
            raise CameraError(
                f"RealSense: its unit of depth is {unit_m} m: that cannot be. Reset the camera."
            )
        rgb, depth_m = _pixels(color), np.asanyarray(depth.get_data()) * np.float32(unit_m)
        if (lens := self._ideal(color)) is not None:
            rgb = lens.colors(rgb)
        if (lens := self._ideal(depth)) is not None:
            depth_m = lens.depth(depth_m)
        K, K_depth, T = _matrix(color), _matrix(depth), _extrinsics(depth, color)
        if self.config.infrared:
            rgb, K = registered_colors(rgb, K, depth_m, K_depth, T), K_depth
        else:
            depth_m = registered_depth(depth_m, K_depth, T, K, rgb.shape[:2])
        return Observation(
            rgb=rgb,
            depth_m=depth_m,
            K=K,
            T_world_camera=np.eye(4),
            qpos=np.zeros(0),
            stamp_s=frames.get_timestamp() / 1000,
            pair=_pair(frames) if self.config.infrared else None,
        )

    def _ideal(self, frame: Any) -> PinholeMap | None:
        """Return the map that removes a lens's distortion; it is computed once.

        The lens model is that of librealsense's own projection (rs2_project_point_to_pixel), which treats the "inverse"
        model as the modified one.
        """
        import pyrealsense2 as rs

        intrinsics = _intrinsics(frame)
        key, model = f"{intrinsics} {intrinsics.coeffs}", intrinsics.model
        if key in self._lenses:
            return self._lenses[key]
        modified = (rs.distortion.modified_brown_conrady, rs.distortion.inverse_brown_conrady)
        ideal = model == rs.distortion.none or not any(intrinsics.coeffs)
        if not ideal and model not in (*modified, rs.distortion.brown_conrady):
            raise CameraError(
                f"RealSense: its lens has the distortion model {model}, which torc does not know. It knows those of "
                "D400 and L500 cameras."
            )
        coefficients = np.zeros(5) if ideal else np.array(intrinsics.coeffs, dtype=float)
        shape = intrinsics.height, intrinsics.width
        self._lenses[key] = pinhole_map(_matrix(frame), shape, coefficients, model in modified)
        return self._lenses[key]


def _intrinsics(frame: Any) -> Any:
    return frame.profile.as_video_stream_profile().intrinsics


def _matrix(frame: Any) -> Float[np.ndarray, "3 3"]:
    """Return K, pixels; librealsense too has pixel centres at integer coordinates."""
    lens = _intrinsics(frame)
    return pinhole_matrix(lens.fx, lens.fy, lens.ppx, lens.ppy)


def _extrinsics(depth: Any, color: Any) -> Float[np.ndarray, "4 4"]:
    """Return T_color_depth: p_color = T @ p_depth. Raises CameraError if a recording lacks it."""
    try:
        found = depth.profile.get_extrinsics_to(color.profile)
    except RuntimeError as error:
        raise CameraError(f"RealSense: where its cameras are is not known: {error}") from error
    # librealsense's is column-major.
    return make_pose(np.reshape(found.rotation, (3, 3)).T, found.translation)


def _pixels(color: Any) -> UInt8[np.ndarray, "h w 3"]:
    """Return a copy of a colour frame, red first."""
    found = color.profile.format().name
    if found not in ("rgb8", "bgr8", "rgba8", "bgra8"):
        raise CameraError(f"RealSense: its colour pictures are {found}. Record them as RGB8 or BGR8.")
    pixels = np.asanyarray(color.get_data())[..., :3]
    return pixels[..., ::-1].copy() if found.startswith("bgr") else pixels.copy()


def _pair(frames: Any) -> StereoPair:
    """Return the infrared pictures; depth belongs to the left camera."""
    left, right = frames.get_infrared_frame(1), frames.get_infrared_frame(2)
    depth = frames.get_depth_frame()
    sizes = {(f.get_width(), f.get_height()) for f in (left, right, depth)}
    if len(sizes) > 1 or np.abs(_matrix(left) - _matrix(depth)).max() > _SAME_PX:
        raise CameraError(
            "RealSense: its infrared pictures have not depth's size and intrinsics. Use the same resolution for both, "
            "or leave out --camera.infrared."
        )
    # p_right = p_left + t: the right camera lies along the left one's x axis.
    baseline_m = -float(left.profile.get_extrinsics_to(right.profile).translation[0])
    if not 0.005 < baseline_m < 0.5:
        raise CameraError(
            f"RealSense: its infrared cameras are {baseline_m:.3f} m apart, which cannot be. Calibrate the camera."
        )
    pictures = [np.array(np.asanyarray(f.get_data()), np.uint8) for f in (left, right)]
    return StereoPair(pictures[0], pictures[1], baseline_m)
