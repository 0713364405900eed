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
_USUAL_SIZES = "320x240 424x240 480x270 640x360 640x480 848x480 960x540 1280x720 1920x1080"
_SIZES = """
512x424 640x400 640x576 672x376 752x480 800x600 960x600 1024x768 1032x772 1280x800 1280x960 1280x1024 1440x1080
1920x1200 2048x1536 2208x1242
"""
"""Picture sizes of cameras, the most common ones first; K often belongs to another one of these."""
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
    low, high = _PRINCIPAL_POINT
    exchanged = max(abs(K[1, 2] / w - 0.5), abs(K[0, 2] / h - 0.5))
    other = _size_around(K, _USUAL_SIZES, _NEAR_CENTRE)
    scale = "scale fx, fy, cx and cy as the pictures were scaled."
    if max(abs(x - 0.5), abs(y - 0.5)) > max(_CENTRED, 2 * exchanged):
        remedy = "It would fit if cx and cy were exchanged: is fx, cx, fy, cy in this order, and K not of a turned one?"
    elif not (low <= x <= high and low <= y <= high):
        remedy = f"So K belongs to another size, about {2 * K[0, 2]:.0f}x{2 * K[1, 2]:.0f}: {scale}"
    elif min(abs(x - 0.5), abs(y - 0.5)) > _CENTRED and other not in (None, (w, h)):
        remedy = f"It is the middle of pictures of {other[0]}x{other[1]} pixels: {scale}"
    else:
        return
    raise InputError(
        f"{where}, key K: the principal point ({K[0, 2]:.1f}, {K[1, 2]:.1f}) lies far from the middle of pictures of "
        f"{w}x{h} pixels. {remedy}"
    )


def _size_around(K: np.ndarray, sizes: str, tolerance: float) -> tuple[int, int] | None:
    """Return the size whose middle the principal point is, to within that share of width and height."""
    known = [(int(w), int(h)) for w, h in (size.split("x") for size in sizes.split())]
    off = {size: float(np.abs((K[:2, 2] + 0.5) / size - 0.5).max()) for size in known}
    nearest = min(known, key=lambda size: off[size])
    return nearest if off[nearest] <= tolerance else None


def intrinsics_doubts(K: np.ndarray, shape: tuple[int, ...]) -> tuple[str, ...]:
    """Return a message if intrinsics (3, 3) that pass `check_intrinsics` fit pictures of another common size best."""
    h, w = shape[:2]
    if np.abs((K[:2, 2] + 0.5) / (w, h) - 0.5).max() < _OFF_CENTRE:
        return ()
    if (other := _size_around(K, _USUAL_SIZES + _SIZES, _AT_CENTRE)) is None:
        return ()
    return (
        f"K seems to be of pictures of {other[0]}x{other[1]} pixels: its principal point ({K[0, 2]:.1f}, "
        f"{K[1, 2]:.1f}) is the middle of those, and these have {w}x{h}. If they were scaled, scale fx and cx with the "
        "width, fy and cy with the height. If they were cut out of larger ones, subtract from cx and cy what was cut "
        "off at the left and at the top; if that was done, nothing is wrong.",
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
