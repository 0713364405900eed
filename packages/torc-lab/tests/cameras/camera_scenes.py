"""What several tests of cameras look at: a table with boxes, from any pose through any ideal lens."""

import numpy as np

from lab_helpers.realsense_feeder import Lens, SoftwareRealSense
from torc.geometry.transforms import invert, look_at, make_pose, rotation_about
from torc.records import Capture, Observation
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import CameraMount

SHAPES = (
    box(0, 0.62, 0.0, (0.06, 0.06, 0.10)),
    box(1, 0.60, -0.2, (0.08, 0.06, 0.12)),
    box(2, 0.72, -0.1, (0.05, 0.05, 0.16)),
)
POSE = look_at((0.05, -0.1, 1.55), (0.64, -0.1, 1.08))
"""Of the camera that depth belongs to."""
T_COLOR_DEPTH = make_pose(rotation_about([0.3, 1, 0.2], 0.02), [0.015, -0.002, 0.001])
DEPTH, COLOR = Lens(320, 240, 260.0), Lens(320, 240, 230.0)


def seen(lens: Lens, pose: np.ndarray) -> Observation:
    """The boxes through a lens with its principal point in the middle, without its distortion."""
    return captured(lens, pose).observation


def captured(lens: Lens, pose: np.ndarray) -> Capture:
    """The same with the true labels."""
    return synthetic_capture(
        SHAPES, CameraMount(pose, lens.width, lens.height, float(2 * np.arctan(lens.height / 2 / lens.f)))
    )


def realsense(unit_m: float = 0.001, T_color_depth: np.ndarray = T_COLOR_DEPTH, **more) -> SoftwareRealSense:
    """A software device that sees the boxes."""
    device = SoftwareRealSense(DEPTH, COLOR, T_color_depth, unit_m=unit_m, **more)
    depth = np.round(seen(DEPTH, POSE).depth_m / unit_m).astype(np.uint16)
    device.pictures = {"depth": depth, "color": seen(COLOR, POSE @ invert(T_color_depth)).rgb}
    return device
