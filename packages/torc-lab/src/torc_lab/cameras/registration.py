"""Register depth, or colours, of one camera to another camera beside it.

librealsense's `rs.align` does that too, but it leaves depth along the first camera's axis. It knows lens distortion
only in the "modified" model, which D400 cameras do not have, and it prefers pixels to one side (2.59, x86-64). Together
that is up to a centimetre at the picture's rim. So torc has its own, for ideal pinholes.
"""

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from torc.geometry.transforms import unproject

_MOST_PX = 8
"""Most pixels of the new picture, along a side, that one pixel of the old one may cover."""
_HAIR_PX = 0.25


def registered_depth(
    depth_m: Float32[np.ndarray, "h w"],
    K: Float[np.ndarray, "3 3"],
    T_other_this: Float[np.ndarray, "4 4"],
    K_other: Float[np.ndarray, "3 3"],
    shape: tuple[int, int],
) -> Float32[np.ndarray, "v u"]:
    """Return depth as the other camera would measure it; 0 where this camera has no reading of the surface.

    A pixel is treated as a square that faces the camera. The other camera's pixels whose middle it covers get its
    depth, the nearest if several squares cover them. So readings are moved, never invented. Squares of a slanted
    surface do not quite meet; pixels in these gaps get the depth of a square within a quarter of a pixel.

    Args:
        depth_m: along this camera's axis, 0 for no reading.
        K, K_other: intrinsics, pixels.
        T_other_this: p_other = T_other_this @ p_this.
        shape: height and width of the other camera's picture, and of the result.
    """
    rows, cols = np.nonzero(depth_m > 0)
    far_first = np.argsort(-depth_m[rows, cols])
    rows, cols = rows[far_first], cols[far_first]
    z = depth_m[rows, cols].astype(np.float64)
    middle = unproject(rows, cols, z, K, T_other_this)[:, 2]
    # The half-open rectangle between two opposite corners, as both cameras are nearly parallel.
    low, high = (_pixels(unproject(rows + d, cols + d, z, K, T_other_this), K_other) for d in (-0.5, 0.5))
    low, high = np.minimum(low, high), np.maximum(low, high)
    low[middle <= 0] = high[middle <= 0] = -1.0
    out = _covered(low, high, middle, shape)
    hair = _covered(low - _HAIR_PX, high + _HAIR_PX, middle, shape)
    out = np.where(np.isfinite(out), out, hair)
    return np.where(np.isfinite(out), out, 0).astype(np.float32)


def _covered(
    low: Float[np.ndarray, "n 2"],
    high: Float[np.ndarray, "n 2"],
    z: Float[np.ndarray, "n"],
    shape: tuple[int, int],
) -> Float[np.ndarray, "v u"]:
    """Return the least z of the rectangles, ordered far to near, that cover each pixel's middle; else infinity."""
    first = np.ceil(low).astype(np.int32)
    count = np.ceil(high).astype(np.int32) - first
    out = np.full(shape, np.inf)
    for dy in range(min(_MOST_PX, int(count[:, 1].max(initial=0)))):
        for dx in range(min(_MOST_PX, int(count[:, 0].max(initial=0)))):
            u, v = first[:, 0] + dx, first[:, 1] + dy
            there = (dx < count[:, 0]) & (dy < count[:, 1])
            there &= (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
            layer = np.full(shape, np.inf)
            layer[v[there], u[there]] = z[there]  # of several the last one stays, which is the nearest
            np.minimum(out, layer, out=out)
    return out


def registered_colors(
    rgb: UInt8[np.ndarray, "v u 3"],
    K_other: Float[np.ndarray, "3 3"],
    depth_m: Float32[np.ndarray, "h w"],
    K: Float[np.ndarray, "3 3"],
    T_other_this: Float[np.ndarray, "4 4"],
) -> UInt8[np.ndarray, "h w 3"]:
    """Return the other camera's colours at the pixels of this camera's depth.

    Pixels are black if they have no reading or the other camera does not see them. The arguments are as in
    `registered_depth`.
    """
    rows, cols = np.mgrid[: depth_m.shape[0], : depth_m.shape[1]]
    points = unproject(rows, cols, depth_m.astype(np.float64), K, T_other_this)
    read = (depth_m > 0) & (points[..., 2] > 0)
    where = np.full((*depth_m.shape, 2), -10.0, np.float32)
    where[read] = _pixels(points[read], K_other)
    return np.asarray(cv2.remap(rgb, where[..., 0], where[..., 1], cv2.INTER_LINEAR), np.uint8)


def _pixels(points: Float[np.ndarray, "n 3"], K: np.ndarray) -> Float[np.ndarray, "n 2"]:
    """Return columns and rows."""
    z = np.maximum(points[:, 2], 1e-6)
    return np.stack([K[0, 0] * points[:, 0] / z + K[0, 2], K[1, 1] * points[:, 1] / z + K[1, 2]], axis=-1)
