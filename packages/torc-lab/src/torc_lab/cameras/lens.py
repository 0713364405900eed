"""Turn pictures of real lenses into those of an ideal pinhole: torc knows intrinsics, but no distortion."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32

_NONE_PX = 0.05
"""A lens that moves no pixel by more than this counts as free of distortion."""


@dataclass(frozen=True)
class PinholeMap:
    """Position in the real picture of each pixel of the ideal one: columns and rows, pixels."""

    cols: Float32[np.ndarray, "h w"]
    rows: Float32[np.ndarray, "h w"]

    def colors(self, picture: np.ndarray) -> np.ndarray:
        """Return the ideal picture of a real one (h, w) or (h, w, 3), uint8; black outside the real picture."""
        return np.asarray(cv2.remap(picture, self.cols, self.rows, cv2.INTER_LINEAR))

    def depth(self, depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
        """Return the ideal depth of a real one, without mixing two surfaces; 0 outside the real picture."""
        return np.asarray(cv2.remap(depth_m, self.cols, self.rows, cv2.INTER_NEAREST))


def pinhole_matrix(fx: float, fy: float, cx: float, cy: float) -> Float[np.ndarray, "3 3"]:
    """Return the intrinsics K, pixels."""
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def pinhole_map(
    K: np.ndarray, shape: tuple[int, ...], coefficients: np.ndarray, modified: bool = False
) -> PinholeMap | None:
    """Return the map that removes a lens's distortion, or None if it moves no pixel noticeably.

    Args:
        K: intrinsics, pixels, before and after.
        shape: the picture's height and width.
        coefficients, modified: the distortion; see `distorted`.
    """
    rows, cols = np.mgrid[: shape[0], : shape[1]]
    x, y = distorted((cols - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1], coefficients, modified)
    moved_cols, moved_rows = K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]
    if max(np.abs(moved_cols - cols).max(), np.abs(moved_rows - rows).max()) <= _NONE_PX:
        return None
    return PinholeMap(moved_cols.astype(np.float32), moved_rows.astype(np.float32))


def distorted(
    x: np.ndarray, y: np.ndarray, coefficients: np.ndarray, modified: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return where a lens shows the points x / z and y / z (Brown 1966).

    Args:
        x, y: the points as an ideal pinhole shows them.
        coefficients: k1, k2, p1, p2, k3 and, in the rational model, k4, k5, k6: OpenCV's order.
        modified: apply the tangential part to the result of the radial one, as librealsense's modified model does.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(np.asarray(coefficients, float), (0, 8 - len(coefficients)))
    r2 = x**2 + y**2
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    a, b = (x * radial, y * radial) if modified else (x, y)
    return (
        x * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a**2),
        y * radial + 2 * p2 * a * b + p1 * (r2 + 2 * b**2),
    )
