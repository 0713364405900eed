"""Rigid transforms as 4x4 matrices; quaternions are wxyz."""

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

Pose = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "*n 4 4"]


def make_pose(R: Float[np.ndarray, "3 3"] | None = None, p: ArrayLike | None = None) -> Pose:
    """Transform with rotation R (identity by default) and translation p (zero by default)."""
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    if p is not None:
        T[:3, 3] = p
    return T


def invert(T: Poses) -> Poses:
    """Inverse of rigid transforms, batched over leading axes."""
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.zeros_like(T)
    out[..., :3, :3] = R_t
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", R_t, T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def transform_points(T: Pose, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Points p mapped to T @ p."""
    return points @ T[:3, :3].T.astype(points.dtype) + T[:3, 3].astype(points.dtype)


def rotation_from_wxyz(wxyz: ArrayLike) -> Float[np.ndarray, "3 3"]:
    """Rotation matrix of a quaternion (normalised here). Raises ValueError for a zero quaternion."""
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
    """Unit quaternion of a rotation matrix, w >= 0 (Shepperd's method)."""
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
    """Rotation by an angle about an axis (Rodrigues)."""
    u = np.asarray(axis, dtype=float)
    u = u / np.linalg.norm(u)
    k = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def look_at(eye: ArrayLike, at: ArrayLike) -> Pose:
    """Camera pose T_world_camera (OpenCV frame) at `eye` that looks at `at`, the image's up towards +z."""
    eye, at = np.asarray(eye, dtype=float), np.asarray(at, dtype=float)
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    if np.linalg.norm(x) < 1e-9:
        raise ValueError("The camera looks straight up or down: its roll is not defined.")
    x /= np.linalg.norm(x)
    return make_pose(np.stack([x, np.cross(z, x), z], axis=1), eye)
