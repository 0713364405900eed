"""Rigid transforms as 4x4 matrices, quaternions wxyz; the pinhole camera in the OpenCV frame; arrays for kernels."""

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike, DTypeLike

Pose = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "*n 4 4"]


def make_pose(R: Float[np.ndarray, "3 3"] | None = None, p: ArrayLike | None = None) -> Pose:
    """Return the transform with rotation R (identity by default) and translation p (zero by default)."""
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    if p is not None:
        T[:3, 3] = p
    return T


def invert(T: Poses) -> Poses:
    """Invert rigid transforms, batched over leading axes."""
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.zeros_like(T)
    out[..., :3, :3] = R_t
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", R_t, T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def transform_points(T: Pose, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Map points p to T @ p."""
    return points @ T[:3, :3].T.astype(points.dtype) + T[:3, 3].astype(points.dtype)


def rotation_from_wxyz(wxyz: ArrayLike) -> Float[np.ndarray, "3 3"]:
    """Return the rotation matrix of a quaternion (normalised here). Raises ValueError for a zero quaternion."""
    q = np.asarray(wxyz, dtype=float)
    norm = np.linalg.norm(q)
    if norm < 1e-12:
        raise ValueError("A quaternion must not be zero.")
    w, x, y, z = q / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def wxyz_from_rotation(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    """Return the unit quaternion of a rotation matrix, w >= 0 (Shepperd's method)."""
    trace = np.trace(R)
    diagonal = np.array([trace, R[0, 0], R[1, 1], R[2, 2]])
    i = int(np.argmax(diagonal))
    q = np.empty(4)
    q[i] = 1.0 + 2.0 * diagonal[i] - trace
    if i == 0:
        q[1:] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
        q[0] = 1.0 + trace
    else:
        a, b, c = i - 1, i % 3, (i + 1) % 3
        q[0] = R[c, b] - R[b, c]
        q[b + 1] = R[b, a] + R[a, b]
        q[c + 1] = R[c, a] + R[a, c]
    q /= np.linalg.norm(q)
    return -q if q[0] < 0 else q


def rotation_about(axis: ArrayLike, angle: float) -> Float[np.ndarray, "3 3"]:
    """Return the rotation by an angle about an axis (Rodrigues)."""
    u = np.asarray(axis, dtype=float)
    u = u / np.linalg.norm(u)
    k = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def look_at(eye: ArrayLike, at: ArrayLike) -> Pose:
    """Return the camera pose T_world_camera (OpenCV frame) at `eye` that looks at `at`, the image's up towards +z."""
    eye, at = np.asarray(eye, dtype=float), np.asarray(at, dtype=float)
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    if np.linalg.norm(x) < 1e-9:
        raise ValueError("The camera looks straight up or down: its roll is not defined.")
    x /= np.linalg.norm(x)
    return make_pose(np.stack([x, np.cross(z, x), z], axis=1), eye)


def intrinsics(width: int, height: int, vertical_fov_rad: float) -> Float[np.ndarray, "3 3"]:
    """Return K of an ideal camera with square pixels and its principal point at the image centre."""
    f = 0.5 * height / np.tan(0.5 * vertical_fov_rad)
    return np.array([[f, 0, 0.5 * (width - 1)], [0, f, 0.5 * (height - 1)], [0, 0, 1.0]])


def unproject(
    rows: np.ndarray, cols: np.ndarray, depth_m: np.ndarray, K: np.ndarray, T_world_camera: Pose
) -> Float[np.ndarray, "*shape 3"]:
    """Return world points of pixels with a depth along the optical axis; rows, cols and depth_m have one shape."""
    x = (cols - K[0, 2]) / K[0, 0] * depth_m
    y = (rows - K[1, 2]) / K[1, 1] * depth_m
    return np.stack([x, y, depth_m], axis=-1) @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]


def masked_points(
    mask: Bool[np.ndarray, "h w"], depth_m: np.ndarray, K: np.ndarray, T_world_camera: Pose
) -> Float[np.ndarray, "n 3"]:
    """Return world points of the pixels in a mask, row by row; all of them have a depth along the optical axis."""
    rows, cols = np.nonzero(mask)
    return unproject(rows, cols, depth_m[mask].astype(float), K, T_world_camera)


def project(
    points: Float[np.ndarray, "n 3"], K: np.ndarray, T_world_camera: Pose
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return columns, rows (subpixel) and depths of world points; meaningless where depth <= 0."""
    T = invert(T_world_camera)
    p = points @ T[:3, :3].T + T[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        return K[0, 0] * p[:, 0] / p[:, 2] + K[0, 2], K[1, 1] * p[:, 1] / p[:, 2] + K[1, 2], p[:, 2]


def kernel_array(array: ArrayLike, dtype: DTypeLike = np.float64) -> np.ndarray:
    """Return the array in C order, of one data type, and writable; copied only if it is not already.

    numba compiles a kernel anew for every other memory order, data type or protection of an argument, so arrays from
    outside, or from functions like `np.broadcast_to` and `np.argwhere`, pass through here on their way to a kernel.
    """
    out = np.ascontiguousarray(array, dtype=dtype)
    return out if out.flags.writeable else out.copy()


_REFERENCE_PX = 640 * 480
"""Pixels of the picture for which settings in pixels were chosen."""


def finer(shape: tuple[int, ...]) -> float:
    """Return the ratio of pixels along a line in a picture (rows, columns) to those of the reference; at least 1."""
    return max(1.0, (shape[0] * shape[1] / _REFERENCE_PX) ** 0.5)
