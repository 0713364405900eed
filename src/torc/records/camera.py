"""A camera's output: snapshots, what their source knows beyond them, and what labels mean."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int16, UInt8

BACKGROUND = -1
"""Label of pixels that belong to no object: table, bin, floor, walls."""
ROBOT = -2
"""Label of pixels that show the robot itself: they hide things behind them, but are not an obstacle."""
TARGET_ID = 0
"""The target's id in a problem and in a frame with masks, as in the paper's images, and that of a target that no look
has shown. Never another object's id. A perception that finds the objects itself may give the target another one.
"""
MAX_OBJECTS = 64
"""Object ids are 0..63: an id is a bit of the occlusion volume's masks."""


@dataclass(frozen=True)
class StereoPair:
    """Two rectified grey pictures, taken at once; the left one shares the observation's frame and intrinsics.

    Attributes:
        left, right: the pictures. A point at depth z appears baseline_m * fx / z pixels further left in the right one.
        baseline_m: distance of the two cameras along the left one's x axis.
    """

    left: UInt8[np.ndarray, "h w"]
    right: UInt8[np.ndarray, "h w"]
    baseline_m: float


@dataclass(frozen=True)
class Observation:
    """One RGB-D snapshot. Camera frame: OpenCV (x right, y down, z forward).

    Attributes:
        rgb: the picture, (h, w, 3) uint8.
        depth_m: distance along the optical axis, (h, w) float32, metres; 0 where there is no reading.
        K: intrinsics, (3, 3), pixels; pixel centres at integer coordinates.
        T_world_camera: camera pose, (4, 4), metres: p_world = T_world_camera @ p_camera.
        qpos: joint positions of the arm at that moment, radians; empty without a robot.
        stamp_s: time of the snapshot, seconds.
        pair: the two pictures of a stereo camera, to compute depth from; None if there are none.
        pose_estimated: True if T_world_camera was estimated from the picture, with the world's origin on the support
            below the camera; it is then not a robot's base frame.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Float[np.ndarray, "4 4"]
    qpos: Float[np.ndarray, "n"]
    stamp_s: float
    pair: StereoPair | None = None
    pose_estimated: bool = False


@dataclass(frozen=True)
class Capture:
    """One camera's snapshot, and the truth if its source knows it: a simulator, or a frame that holds masks.

    No task planner and no grasp planner receives a capture; a perception receives the label image only if it declares
    `needs_labels`.

    Attributes:
        observation: the snapshot.
        label_image: object id per pixel: BACKGROUND (-1), ROBOT (-2), or 0 to 63; None if unknown.
    """

    observation: Observation
    label_image: Int16[np.ndarray, "h w"] | None = None


def as_capture(seen: Observation | Capture) -> Capture:
    """Return a snapshot as a capture, without a label image if it is an observation."""
    return seen if isinstance(seen, Capture) else Capture(seen)
