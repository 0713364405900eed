"""Pictures of real lenses as an ideal pinhole would have taken them: torc knows intrinsics, but no distortion."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32

_NONE_PX = 0.05
"""A lens that moves no pixel by more than this has no distortion."""


@dataclass(frozen=True)
class PinholeMap:
    """Where in the real picture each pixel of the ideal one lies: columns and rows, pixels."""

    cols: Float32[np.ndarray, "h w"]
    rows: Float32[np.ndarray, "h w"]

    def colors(self, picture: np.ndarray) -> np.ndarray:
        """The ideal picture of a real one (h, w) or (h, w, 3), uint8; black where nothing was seen."""
        return np.asarray(cv2.remap(picture, self.cols, self.rows, cv2.INTER_LINEAR))

    def depth(self, depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
        """Depth likewise, never mixed of two surfaces; 0 where nothing was seen."""
        return np.asarray(cv2.remap(depth_m, self.cols, self.rows, cv2.INTER_NEAREST))


def pinhole_matrix(fx: float, fy: float, cx: float, cy: float) -> Float[np.ndarray, "3 3"]:
    """K, pixels."""
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def pinhole_map(
    K: np.ndarray, shape: tuple[int, ...], coefficients: np.ndarray, modified: bool = False
) -> PinholeMap | None:
    """The map for a lens with that distortion (see `distorted`), for intrinsics K (3, 3) before and after; None where
    it moves nothing.
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
    """Points x / z, y / z as a lens shows them, by k1, k2, p1, p2, k3 and, in the rational model, k4, k5, k6, in
    OpenCV's order (Brown 1966). In the modified form, which librealsense has beside it, the tangential part acts on
    what the radial one gave.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(np.asarray(coefficients, float), (0, 8 - len(coefficients)))
    r2 = x**2 + y**2
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    a, b = (x * radial, y * radial) if modified else (x, y)
    return (
        x * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a**2),
        y * radial + 2 * p2 * a * b + p1 * (r2 + 2 * b**2),
    )
