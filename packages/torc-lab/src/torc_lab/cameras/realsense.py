"""The camera `realsense`: Intel RealSense D400 and its kin, by pyrealsense2.

Depth is registered to the colour picture (torc_lab.cameras.registration), so both are of the colour camera, with the
lens's distortion taken out; intrinsics, extrinsics and the unit of depth come from the device. With `infrared` all is
of the left infrared camera instead, which depth belongs to, and the observation holds both infrared pictures: `--depth
sgbm` can match them. Colour is then missing where depth is.
"""

from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float, UInt8

from torc import Observation
from torc.errors import CameraError
from torc.geometry.transforms import make_pose
from torc.records import StereoPair
from torc.workspace.description import Workspace
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.lens import PinholeMap, brown_conrady, pinhole_map
from torc_lab.cameras.realsense_device import (
    FrameSets,
    Opener,
    PipelineFrames,
    RealSenseConfig,
    realsense_devices,
    realsense_library,
)
from torc_lab.cameras.registration import registered_colors, registered_depth

_MOST_SETS = 30
"""Sets of pictures that may lack a stream, one after another."""
_SAME_PX = 0.5
"""The left infrared picture has depth's intrinsics, up to this."""


class RealSenseCamera(RealCamera):
    """A RealSense camera, or a recording of one."""

    what: ClassVar[str] = "RealSense"

    @classmethod
    def check_library(cls) -> None:
        """Raise MissingDependencyError without pyrealsense2."""
        realsense_library()

    @classmethod
    def devices(cls) -> list[str]:
        """Return the connected devices."""
        return realsense_devices()

    def __init__(
        self,
        config: RealSenseConfig | None = None,
        workspace: Workspace | None = None,
        open_frames: Opener = PipelineFrames,
    ) -> None:
        """`open_frames` opens the device."""
        self.config = RealSenseConfig() if config is None else config
        super().__init__(self.config.pose, workspace)
        self._open = open_frames
        self._frames: FrameSets | None = None
        self._lenses: dict[str, PinholeMap | None] = {}

    def close(self) -> None:
        """Frees the device; the next capture opens it again."""
        frames, self._frames = self._frames, None
        if frames is not None:
            frames.close()

    def _shoot(self) -> Observation:
        if self._frames is None:
            self._frames = self._open(self.config)
            for _ in range(0 if self.config.file else self.config.warm_up):
                self._frames.wait()
        return self._observation(self._complete(self._frames))

    def _complete(self, source: FrameSets) -> Any:
        """The next set with all streams: the first ones after opening may lack some."""
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
            f"{self.what}: its pictures lack {', '.join(missing)}. Choose a camera, or a recording, with these streams"
            f"{', or leave out --camera.infrared' if self.config.infrared else ''}."
        )

    def _observation(self, frames: Any) -> Observation:
        color, depth = frames.get_color_frame(), frames.get_depth_frame()
        unit_m = float(depth.get_units())
        if not 1e-6 <= unit_m <= 0.1:
            raise CameraError(
                f"{self.what}: its unit of depth is {unit_m} m, which cannot be. Reset the camera."
            )
        rgb, depth_m = _pixels(color), np.asanyarray(depth.get_data()) * np.float32(unit_m)
        of_color, of_depth = (f.profile.as_video_stream_profile().intrinsics for f in (color, depth))
        if (lens := self._ideal(of_color)) is not None:
            rgb = lens.colors(rgb)
        if (lens := self._ideal(of_depth)) is not None:
            depth_m = lens.depth(depth_m)
        K, K_depth, T = _matrix(of_color), _matrix(of_depth), _extrinsics(depth, color)
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

    def _ideal(self, intrinsics: Any) -> PinholeMap | None:
        """The map that takes a lens's distortion out; made once."""
        key = f"{intrinsics} {intrinsics.coeffs}"
        if key not in self._lenses:
            self._lenses[key] = _lens_map(intrinsics)
        return self._lenses[key]


def _matrix(intrinsics: Any) -> Float[np.ndarray, "3 3"]:
    """K, pixels; librealsense too has pixel centres at integer coordinates."""
    return np.array(
        [[intrinsics.fx, 0, intrinsics.ppx], [0, intrinsics.fy, intrinsics.ppy], [0, 0, 1]], dtype=float
    )


def _extrinsics(depth: Any, color: Any) -> Float[np.ndarray, "4 4"]:
    """T_color_depth: p_color = T @ p_depth. Raises CameraError for a recording without."""
    try:
        found = depth.profile.get_extrinsics_to(color.profile)
    except RuntimeError as error:
        raise CameraError(f"RealSense: where its cameras are is not known: {error}") from error
    return make_pose(
        np.reshape(found.rotation, (3, 3)).T, found.translation
    )  # librealsense's is column-major


def _lens_map(intrinsics: Any) -> PinholeMap | None:
    """The lens as librealsense's own projection has it (rs2_project_point_to_pixel): it treats the "inverse" model as
    the modified one.
    """
    import pyrealsense2 as rs

    model, coefficients = intrinsics.model, np.array(intrinsics.coeffs, dtype=float)
    if not coefficients.any() or model == rs.distortion.none:
        return None
    modified = (rs.distortion.modified_brown_conrady, rs.distortion.inverse_brown_conrady)
    if model not in (*modified, rs.distortion.brown_conrady):
        raise CameraError(
            f"RealSense: its lens has the distortion model {model}, which torc does not know. It knows those of D400 "
            "and L500 cameras."
        )
    shape = intrinsics.height, intrinsics.width
    return pinhole_map(_matrix(intrinsics), shape, brown_conrady(coefficients, model in modified))


def _pixels(color: Any) -> UInt8[np.ndarray, "h w 3"]:
    """A copy of a colour frame, red first."""
    import pyrealsense2 as rs

    order = {rs.format.rgb8: (0, 1, 2), rs.format.bgr8: (2, 1, 0)}
    order |= {rs.format.rgba8: (0, 1, 2), rs.format.bgra8: (2, 1, 0)}
    found = color.profile.format()
    if found not in order:
        raise CameraError(f"RealSense: its colour pictures are {found}. Record them as RGB8 or BGR8.")
    return np.ascontiguousarray(np.asanyarray(color.get_data())[..., order[found]])


def _pair(frames: Any) -> StereoPair:
    """The infrared pictures; the left camera is the one that depth belongs to."""
    left, right = frames.get_infrared_frame(1), frames.get_infrared_frame(2)
    of_left, of_depth = (
        f.profile.as_video_stream_profile().intrinsics for f in (left, frames.get_depth_frame())
    )
    sizes = {(f.get_width(), f.get_height()) for f in (left, right, frames.get_depth_frame())}
    if len(sizes) > 1 or np.abs(_matrix(of_left) - _matrix(of_depth)).max() > _SAME_PX:
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
