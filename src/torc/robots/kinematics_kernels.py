"""Kinematics as compiled kernels on plain arrays.

Affine 4x4 matrices; their last row is assumed to be 0 0 0 1. Kernels that only read poses accept them without that row,
too.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def multiply_affine(A: np.ndarray, B: np.ndarray, out: np.ndarray) -> None:
    """Compute out = A @ B; out must be neither A nor B."""
    for i in range(3):
        a0, a1, a2 = A[i, 0], A[i, 1], A[i, 2]
        for j in range(4):
            out[i, j] = a0 * B[0, j] + a1 * B[1, j] + a2 * B[2, j]
        out[i, 3] += A[i, 3]
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0


@njit(cache=True)
def rotate_about(axis: np.ndarray, angle: float, out: np.ndarray) -> None:
    """Write the rotation about a unit axis to out[:3, :3] (Rodrigues)."""
    x, y, z = axis[0], axis[1], axis[2]
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    out[0, 0] = c + x * x * v
    out[0, 1] = x * y * v - z * s
    out[0, 2] = x * z * v + y * s
    out[1, 0] = x * y * v + z * s
    out[1, 1] = c + y * y * v
    out[1, 2] = y * z * v - x * s
    out[2, 0] = x * z * v - y * s
    out[2, 1] = y * z * v + x * s
    out[2, 2] = c + z * z * v


@njit(cache=True)
def link_poses_kernel(
    T_world_base: np.ndarray, Ts_parent_joint: np.ndarray, axes: np.ndarray, T_last_tool0: np.ndarray,
    qpos: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Write world poses of all links, then of tool0, to out (n, dof + 1, 4, 4), for qpos (n, dof)."""
    n, dof = qpos.shape
    joint, turn = np.zeros((4, 4)), np.zeros((4, 4))
    turn[3, 3] = 1.0
    for k in range(n):
        for i in range(dof):
            if i == 0:
                multiply_affine(T_world_base, Ts_parent_joint[0], joint)
            else:
                multiply_affine(out[k, i - 1], Ts_parent_joint[i], joint)
            rotate_about(axes[i], qpos[k, i], turn)
            multiply_affine(joint, turn, out[k, i])
        multiply_affine(out[k, dof - 1], T_last_tool0, out[k, dof])


@njit(cache=True)
def jacobian_kernel(Ts_link: np.ndarray, axes: np.ndarray, out: np.ndarray) -> None:
    """Write the geometric Jacobian of tool0 to out (6, dof): linear rows, then angular, world frame."""
    dof = axes.shape[0]
    p = Ts_link[dof]
    for i in range(dof):
        T, a = Ts_link[i], axes[i]
        wx = T[0, 0] * a[0] + T[0, 1] * a[1] + T[0, 2] * a[2]
        wy = T[1, 0] * a[0] + T[1, 1] * a[1] + T[1, 2] * a[2]
        wz = T[2, 0] * a[0] + T[2, 1] * a[1] + T[2, 2] * a[2]
        dx, dy, dz = p[0, 3] - T[0, 3], p[1, 3] - T[1, 3], p[2, 3] - T[2, 3]
        out[0, i], out[1, i], out[2, i] = wy * dz - wz * dy, wz * dx - wx * dz, wx * dy - wy * dx
        out[3, i], out[4, i], out[5, i] = wx, wy, wz


@njit(cache=True)
def pose_error(T: np.ndarray, goal: np.ndarray, out: np.ndarray) -> float:
    """Write position and rotation-vector error of T from goal, world frame, to out (6,); return the largest entry."""
    for i in range(3):
        out[i] = goal[i, 3] - T[i, 3]
    # Vector part and trace of D = R_goal R^T.
    x = y = z = trace = 0.0
    for i in range(3):
        x += goal[2, i] * T[1, i] - goal[1, i] * T[2, i]
        y += goal[0, i] * T[2, i] - goal[2, i] * T[0, i]
        z += goal[1, i] * T[0, i] - goal[0, i] * T[1, i]
        trace += goal[0, i] * T[0, i] + goal[1, i] * T[1, i] + goal[2, i] * T[2, i]
    s, c = 0.5 * np.sqrt(x * x + y * y + z * z), 0.5 * (trace - 1.0)
    scale = 0.5 * np.arctan2(s, c) / s if s > 1e-9 else 0.5
    out[3], out[4], out[5] = scale * x, scale * y, scale * z
    if s <= 1e-9 and c < 0.0:
        # Half a turn off: the axis is lost, and any will do to get away.
        out[3] = np.pi
    return np.max(np.abs(out))
