"""The pinhole camera: between pixels, depth and points. OpenCV frame, pixel centres at integer coordinates."""

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, invert


def intrinsics(width: int, height: int, vertical_fov_rad: float) -> Float[np.ndarray, "3 3"]:
    """K of an ideal camera with square pixels and its principal point at the image centre."""
    f = 0.5 * height / np.tan(0.5 * vertical_fov_rad)
    return np.array([[f, 0, 0.5 * (width - 1)], [0, f, 0.5 * (height - 1)], [0, 0, 1.0]])


def unproject(
    rows: np.ndarray, cols: np.ndarray, depth_m: np.ndarray, K: np.ndarray, T_world_camera: Pose
) -> Float[np.ndarray, "*shape 3"]:
    """World points of pixels with a depth along the optical axis; rows, cols and depth_m have one shape."""
    x = (cols - K[0, 2]) / K[0, 0] * depth_m
    y = (rows - K[1, 2]) / K[1, 1] * depth_m
    return np.stack([x, y, depth_m], axis=-1) @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]


def project(
    points: Float[np.ndarray, "n 3"], K: np.ndarray, T_world_camera: Pose
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns, rows (subpixel) and depths of world points; meaningless where depth <= 0."""
    T = invert(T_world_camera)
    p = points @ T[:3, :3].T + T[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        return K[0, 0] * p[:, 0] / p[:, 2] + K[0, 2], K[1, 1] * p[:, 1] / p[:, 2] + K[1, 2], p[:, 2]
