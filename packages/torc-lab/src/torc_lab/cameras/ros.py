"""The camera `ros`: image topics of ROS 1 or ROS 2, by rosbridge. ROS is not needed on this machine.

Each snapshot subscribes to the topics, takes a colour and a depth picture of one moment, and unsubscribes: a picture
takes 1 to 3 MB as JSON, too much to send thirty times a second.
"""

import time
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from torc import InputError, Observation
from torc.errors import CameraError, MissingDependencyError, extra_remedy
from torc.workspace.description import Workspace
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.ros_messages import RosImage, RosLens, read_image, read_lens
from torc_lab.rosbridge.client import Newest, Rosbridge, RosbridgeError

_PICTURES = tuple(
    f"sensor_msgs/{form}{kind}"
    for kind in ("Image", "CompressedImage", "CameraInfo")
    for form in ("", "msg/")
)


@dataclass(frozen=True)
class RosConfig:
    """Image topics.

    Attributes:
        url: address of rosbridge.
        color, depth, info: topics of the colour picture, of depth that is registered to it, and of its CameraInfo. The
            defaults are realsense-ros's with align_depth on; in ROS 2 they begin with /camera/camera.
        rectified: the pictures were rectified in ROS (image_rect_color and the like): P of CameraInfo holds, not K.
        same_frame: refuse depth whose header names another frame than the colour picture's: it is not registered.
        max_lag_s: largest time between a colour and a depth picture that are used together.
        timeout_s: how long to wait for the connection, and for pictures.
        pose: the colour camera's pose: level, workspace, 16 numbers or a file; see torc_lab.cameras.poses.
    """

    url: str = "ws://localhost:9090"
    color: str = "/camera/color/image_raw"
    depth: str = "/camera/aligned_depth_to_color/image_raw"
    info: str = "/camera/color/camera_info"
    rectified: bool = False
    same_frame: bool = True
    max_lag_s: float = 0.1
    timeout_s: float = 5.0
    pose: str | tuple[float, ...] = "level"

    def __post_init__(self) -> None:
        if not (self.max_lag_s >= 0 and self.timeout_s > 0):
            raise InputError("RosConfig: timeout_s must be above 0, max_lag_s at least 0.")


class RosCamera(RealCamera):
    """A camera whose pictures ROS publishes."""

    what: ClassVar[str] = "The ROS camera"

    @classmethod
    def check_library(cls) -> None:
        if find_spec("websockets") is None:
            raise MissingDependencyError("websockets, for rosbridge,", extra_remedy("ros"))

    def __init__(self, config: RosConfig | None = None, workspace: Workspace | None = None) -> None:
        self.config = RosConfig() if config is None else config
        super().__init__(self.config.pose, workspace)

    def _shoot(self) -> Observation:
        c = self.config
        try:
            if self._device is None:
                self._device = Rosbridge(c.url, c.timeout_s)
            info, color, depth = self._messages(self._device)
        except RosbridgeError as error:
            there = "" if self._device is None else self._device.published(_PICTURES)
            raise CameraError(f"{self.what}: {error}{there}") from error
        return self._observation(color, depth, read_lens(c.info, info, c.rectified))

    def _messages(self, bridge: Rosbridge) -> tuple[Any, RosImage, RosImage]:
        """Return CameraInfo, a colour and a depth picture, all sent after this call."""
        c, deadline = self.config, time.monotonic() + self.config.timeout_s
        with ExitStack() as stack:
            info, color, depth = (
                stack.enter_context(Newest(bridge, t, deadline)) for t in (c.info, c.color, c.depth)
            )
            return info.message(), *self._of_one_moment(color, depth)

    def _of_one_moment(self, color: Newest, depth: Newest) -> tuple[RosImage, RosImage]:
        """Return the first colour and depth picture that are at most max_lag_s apart."""
        sources = color, depth
        pictures = [read_image(source.topic, source.message()) for source in sources]
        while (apart_s := abs(pictures[0].stamp_s - pictures[1].stamp_s)) > self.config.max_lag_s:
            older = int(pictures[1].stamp_s < pictures[0].stamp_s)
            try:
                pictures[older] = read_image(sources[older].topic, sources[older].message())
            except RosbridgeError as error:
                raise RosbridgeError(
                    f"{error} Its last picture is {apart_s:.3f} s older than the other's, more than --camera.max-lag-s "
                    f"{self.config.max_lag_s:g}. Do their clocks agree? Else raise that: the scene is at rest."
                ) from error
        return pictures[0], pictures[1]

    def _observation(self, color: RosImage, depth: RosImage, lens: RosLens) -> Observation:
        c, rgb, depth_m = self.config, color.colors(), depth.depth_m()
        sizes = {c.color: rgb.shape[1::-1], c.depth: depth_m.shape[1::-1], c.info: (lens.width, lens.height)}
        if len(set(sizes.values())) > 1:
            raise InputError(
                f"{self.what}: sizes differ: {', '.join(f'{topic} {w}x{h}' for topic, (w, h) in sizes.items())} "
                "pixels. Register depth to the colour picture (realsense-ros: align_depth; else "
                "depth_image_proc/register), and give its topic."
            )
        if c.same_frame and color.frame_id != depth.frame_id:
            raise InputError(
                f"{self.what}: {c.color} is in the frame '{color.frame_id}', {c.depth} in '{depth.frame_id}': depth is "
                "not registered to the colour picture. Give a topic of registered depth; or, if it is and its header "
                "is wrong, --camera.same-frame false."
            )
        if lens.ideal is not None:
            rgb, depth_m = lens.ideal.colors(rgb), lens.ideal.depth(depth_m)
        return Observation(rgb, depth_m, lens.K, np.eye(4), np.zeros(0), color.stamp_s)
