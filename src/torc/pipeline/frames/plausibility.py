"""Refuse implausible pictures with the likely cause: depth, intrinsics, poses."""

import numpy as np
from jaxtyping import Float32

from torc.errors import InputError

MAX_MEDIAN_DEPTH_M = 30.0
"""Beyond this the unit is wrong: millimetres read as metres."""
MIN_MEDIAN_DEPTH_M = 0.02
_FARTHEST_M = 100.0
_PRINCIPAL_POINT = (0.2, 0.8)
"""Least and largest cx and cy, as shares of width and height."""
_CENTRED, _NEAR_CENTRE = 0.1, 0.03
_SIZES = (
    (320, 240),
    (424, 240),
    (480, 270),
    (640, 360),
    (640, 480),
    (848, 480),
    (960, 540),
    (1280, 720),
    (1920, 1080),
)
"""Common picture sizes; K often belongs to another one of these."""
_MORE_SIZES = (
    *(
        (512, 424),
        (640, 400),
        (640, 576),
        (672, 376),
        (752, 480),
        (800, 600),
        (960, 600),
        (1024, 768),
        (1032, 772),
    ),
    *((1280, 800), (1280, 960), (1280, 1024), (1440, 1080), (1920, 1200), (2048, 1536), (2208, 1242)),
)
_OFF_CENTRE, _AT_CENTRE = 0.08, 0.01
"""Shares of width and height. A picture cut at random out of another of these sizes is doubted in 1 % of cases."""


def clean_depth(where: str, depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Return depth with 0 for no reading, also for NaN and infinity (ROS's convention).

    Raises InputError, its text beginning with `where`, if depth is negative, empty, or in a wrong unit.
    """
    depth = np.where(np.isfinite(depth_m), depth_m, np.float32(0))
    if (depth < 0).any():
        raise InputError(f"{where}: depth holds negative values; 0 or NaN stand for no reading.")
    if not (depth > 0).any():
        raise InputError(f"{where}: depth is empty: not one pixel has a reading above 0.")
    median = float(np.median(depth[depth > 0]))
    if not MIN_MEDIAN_DEPTH_M < median < MAX_MEDIAN_DEPTH_M:
        fit = next(
            (f" Divided by {f} it would be {median / f:.2f} m." for f in (1000, 10) if 0.1 < median / f < 5),
            "",
        )
        raise InputError(
            f"{where}: median depth is {median:.4g} m; the unit or scale of the depth is wrong.{fit}"
        )
    return depth


def check_intrinsics(where: str, K: np.ndarray, shape: tuple[int, ...]) -> None:
    """Raise InputError if K (3, 3) is not a matrix of intrinsics, or does not fit pictures of that height and width."""
    h, w = shape[:2]
    if K[0, 0] <= 0 or K[1, 1] <= 0 or np.abs(K[2] - [0, 0, 1]).max() > 1e-6:
        raise InputError(
            f"{where}, key K: {K.tolist()} are no intrinsics: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]."
        )
    if not (-w < K[0, 2] < 2 * w and -h < K[1, 2] < 2 * h) or not 0.05 * w < K[0, 0] < 50 * w:
        raise InputError(
            f"{where}, key K: {K.tolist()} does not fit images of {w}x{h} pixels. Were they scaled?"
        )
    x, y = K[0, 2] / w, K[1, 2] / h
    centre = f"{where}, key K: the principal point ({K[0, 2]:.1f}, {K[1, 2]:.1f})"
    exchanged = max(abs(K[1, 2] / w - 0.5), abs(K[0, 2] / h - 0.5))
    if max(abs(x - 0.5), abs(y - 0.5)) > max(_CENTRED, 2 * exchanged):
        raise InputError(
            f"{centre} would fit the pictures of {w}x{h} pixels if cx and cy were exchanged. Is fx, cx, fy, cy in "
            "this order, and K not of a turned picture?"
        )
    low, high = _PRINCIPAL_POINT
    if not (low <= x <= high and low <= y <= high):
        raise InputError(
            f"{centre} lies far from the middle of pictures of {w}x{h} pixels, so K belongs to pictures of another "
            f"size, about {2 * K[0, 2]:.0f}x{2 * K[1, 2]:.0f}. Scale fx, fy, cx and cy as the pictures were scaled."
        )
    sizes = [size for size in _SIZES if size != (w, h)]
    off = min(abs(x - 0.5), abs(y - 0.5)) > _CENTRED
    for width, height in sizes if off else ():
        if max(abs(K[0, 2] / width - 0.5), abs(K[1, 2] / height - 0.5)) < _NEAR_CENTRE:
            raise InputError(
                f"{centre} is the middle of pictures of {width}x{height} pixels, and these have {w}x{h}. Scale fx, fy, "
                "cx and cy as the pictures were scaled."
            )


def intrinsics_doubts(K: np.ndarray, shape: tuple[int, ...]) -> tuple[str, ...]:
    """Return a message if intrinsics (3, 3) that pass `check_intrinsics` fit pictures of another common size best."""
    h, w = shape[:2]
    middle = K[:2, 2] + 0.5
    if np.abs(middle / (w, h) - 0.5).max() < _OFF_CENTRE:
        return ()
    off = {size: float(np.abs(middle / size - 0.5).max()) for size in (*_SIZES, *_MORE_SIZES)}
    width, height = min(off, key=lambda size: off[size])
    if off[width, height] > _AT_CENTRE:
        return ()
    return (
        f"K seems to be of pictures of {width}x{height} pixels: its principal point ({K[0, 2]:.1f}, {K[1, 2]:.1f}) is "
        f"the middle of those, and these have {w}x{h}. If they were scaled, scale fx and cx with the width, fy and cy "
        "with the height. If they were cut out of larger ones, subtract from cx and cy what was cut off at the left "
        "and at the top; if that was done, nothing is wrong.",
    )


def check_pose(where: str, T: np.ndarray) -> None:
    """Raise InputError if a matrix (4, 4) is not a rigid transform."""
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
