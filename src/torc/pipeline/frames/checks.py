"""What makes no sense in a picture from outside is refused with its likely cause: depth, intrinsics, poses."""

import numpy as np
from jaxtyping import Float32

from torc.errors import InputError

MAX_MEDIAN_DEPTH_M = 30.0
"""Beyond this the unit is wrong: millimetres taken for metres."""
MIN_MEDIAN_DEPTH_M = 0.02
_FARTHEST_M = 100.0


def clean_depth(where: str, depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Depth with 0 where there is no reading: NaN and infinity mean that too (as ROS has it).

    Raises InputError, its text beginning with `where`, for negative depth, none at all, and a wrong unit.
    """
    depth = np.where(np.isfinite(depth_m), depth_m, np.float32(0))
    if (depth < 0).any():
        raise InputError(f"{where}: depth holds negative values; 0 or NaN stand for no reading.")
    if not (depth > 0).any():
        raise InputError(f"{where}: depth is empty: not one pixel has a reading above 0.")
    median = float(np.median(depth[depth > 0]))
    if not MIN_MEDIAN_DEPTH_M < median < MAX_MEDIAN_DEPTH_M:
        raise InputError(f"{where}: median depth is {median:.4g} m; the unit or scale of the depth is wrong.")
    return depth


def check_intrinsics(where: str, K: np.ndarray, shape: tuple[int, ...]) -> None:
    """Raises InputError for intrinsics (3, 3) that are none, or do not fit pictures of that height and width."""
    h, w = shape[:2]
    if K[0, 0] <= 0 or K[1, 1] <= 0 or np.abs(K[2] - [0, 0, 1]).max() > 1e-6:
        raise InputError(
            f"{where}, key K: {K.tolist()} are no intrinsics: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]."
        )
    if not (-w < K[0, 2] < 2 * w and -h < K[1, 2] < 2 * h) or not 0.05 * w < K[0, 0] < 50 * w:
        raise InputError(
            f"{where}, key K: {K.tolist()} does not fit images of {w}x{h} pixels. Were they scaled?"
        )


def check_pose(where: str, T: np.ndarray) -> None:
    """Raises InputError for a matrix (4, 4) that is no rigid transform."""
    R = T[:3, :3]
    rigid = np.abs(R @ R.T - np.eye(3)).max() < 1e-3 and np.linalg.det(R) > 0
    if not rigid or np.abs(T[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise InputError(
            f"{where}, camera pose: its upper left 3x3 block is not a rotation, or its last row not 0, 0, 0, 1. "
            "Give the pose of the camera in the world (p_world = T @ p_camera), without scale or mirror."
        )
    if np.abs(T[:3, 3]).max() > _FARTHEST_M:
        raise InputError(
            f"{where}, camera pose: it is {np.abs(T[:3, 3]).max():.0f} m from the origin. Are these millimetres? Give "
            "metres."
        )
