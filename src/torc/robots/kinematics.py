"""Forward kinematics of an arm: compiled, on plain arrays, and batched.

Kernels take and write affine poses with or without their last row, 0 0 0 1.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.geometry.transforms import Pose, kernel_array
from torc.robots.description import ArmDescription, Qpos, RobotDescription


class Chain(NamedTuple):
    """An arm for `forward`: T_world_base, Ts_parent_joint, axes and T_last_tool0 of its description."""

    base: np.ndarray
    parents: np.ndarray
    axes: np.ndarray
    tool: np.ndarray


def chain_of(arm: ArmDescription) -> Chain:
    """Return the arm for `forward`."""
    parts = (arm.T_world_base, arm.Ts_parent_joint, arm.axes, arm.T_last_tool0)
    return Chain(*map(kernel_array, parts))


def link_poses(arm: ArmDescription, qpos: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n links 4 4"]:
    """Return world poses of the dof links and, last, of tool0. Raises ValueError for another number of joints."""
    q = kernel_array(qpos)
    if q.ndim != 2 or q.shape[1] != arm.dof:
        raise ValueError(f"qpos must be (n, {arm.dof}); it is {np.shape(qpos)}.")
    out = np.zeros((len(q), arm.dof + 1, 4, 4))
    out[:, :, 3, 3] = 1.0
    _forward_each(q, chain_of(arm), out)
    return out


def tool0_poses(arm: ArmDescription, qpos: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n 4 4"]:
    """Return world poses of the flange."""
    return link_poses(arm, qpos)[:, -1]


def tcp_pose(robot: RobotDescription, q: Qpos, width_m: float) -> Pose:
    """Return the world pose of the TCP at one configuration."""
    return tool0_poses(robot.arm, np.asarray(q)[None])[0] @ robot.gripper.T_tool0_tcp(width_m)


def sphere_centers(
    robot: RobotDescription, qpos: Float[np.ndarray, "n dof"], width_m: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n s 3"]:
    """Return world centres of robot.spheres per configuration. Raises InputError for an impossible opening."""
    poses, link = link_poses(robot.arm, qpos), robot.spheres.link
    widths = np.broadcast_to(np.asarray(width_m, dtype=np.float64), len(poses))
    fingers = poses[:, -1] @ robot.gripper.Ts_tool0_tcp_at(widths)
    frames = np.concatenate([poses, fingers[:, None], fingers[:, None]], axis=1)[:, link]
    side = np.select([link == robot.arm.dof + 1, link == robot.arm.dof + 2], [-0.5, 0.5], 0.0)
    local = np.tile(robot.spheres.centers, (len(poses), 1, 1))
    local[:, :, 0] += side * widths[:, None]
    return np.einsum("nsij,nsj->nsi", frames[:, :, :3, :3], local) + frames[:, :, :3, 3]


@njit(cache=True)
def _compose(A, B, out):
    for i in range(3):
        for j in range(4):
            s = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
            out[i, j] = s + A[i, 3] if j == 3 else s


@njit(cache=True)
def rotate_about(axis, angle, out):
    """Write the rotation about a unit axis to out[:3, :3] (Rodrigues)."""
    x, y, z = axis[0], axis[1], axis[2]
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + x * x * v, x * y * v - z * s, x * z * v + y * s
    out[1, 0], out[1, 1], out[1, 2] = x * y * v + z * s, c + y * y * v, y * z * v - x * s
    out[2, 0], out[2, 1], out[2, 2] = x * z * v - y * s, y * z * v + x * s, c + z * z * v


@njit(cache=True)
def forward(q, chain, Ts, scratch):
    """Write world poses of all links at q, then of tool0, to Ts (dof + 1 poses); scratch: two poses."""
    dof = q.shape[0]
    joint, turn = scratch
    for i in range(dof):
        _compose(chain.base if i == 0 else Ts[i - 1], chain.parents[i], joint)
        rotate_about(chain.axes[i], q[i], turn)
        for r in range(3):
            for c in range(3):
                Ts[i, r, c] = joint[r, 0] * turn[0, c] + joint[r, 1] * turn[1, c] + joint[r, 2] * turn[2, c]
            Ts[i, r, 3] = joint[r, 3]
    _compose(Ts[dof - 1], chain.tool, Ts[dof])


@njit(cache=True)
def _forward_each(qpos, chain, out):
    scratch = np.empty((2, 3, 4))
    for k in range(len(qpos)):
        forward(qpos[k], chain, out[k], scratch)


@njit(cache=True)
def jacobian(Ts, axes, out):
    """Write the geometric Jacobian of tool0 to out (6, dof): linear rows, then angular, world frame."""
    dof = axes.shape[0]
    p = Ts[dof]
    for i in range(dof):
        T, a = Ts[i], axes[i]
        wx = T[0, 0] * a[0] + T[0, 1] * a[1] + T[0, 2] * a[2]
        wy = T[1, 0] * a[0] + T[1, 1] * a[1] + T[1, 2] * a[2]
        wz = T[2, 0] * a[0] + T[2, 1] * a[1] + T[2, 2] * a[2]
        dx, dy, dz = p[0, 3] - T[0, 3], p[1, 3] - T[1, 3], p[2, 3] - T[2, 3]
        out[0, i], out[1, i], out[2, i] = wy * dz - wz * dy, wz * dx - wx * dz, wx * dy - wy * dx
        out[3, i], out[4, i], out[5, i] = wx, wy, wz


@njit(cache=True)
def pose_error(T, goal, out):
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
    # NaN if anything is: a comparison, number by number, would lose it, and a broken pose would count as met.
    return np.max(np.abs(out))


@njit(cache=True)
def pose_step(J, error, damping, work, out):
    """Write the change of the joints that takes back an error of the pose, damped: J^T (J J^T + damping)^-1 error.

    `work` (7, 6) is overwritten. By Cholesky's method here: for six equations, the way to LAPACK and back takes longer
    than the solution, and threads wait for each other there.
    """
    A, y = work[:6], work[6]
    for i in range(6):
        for j in range(i + 1):
            total = damping if i == j else 0.0
            for k in range(J.shape[1]):
                total += J[i, k] * J[j, k]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(total) if i == j else total / A[j, j]
    for i in range(6):
        y[i] = error[i]
        for k in range(i):
            y[i] -= A[i, k] * y[k]
        y[i] /= A[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            y[i] -= A[k, i] * y[k]
        y[i] /= A[i, i]
    for d in range(J.shape[1]):
        out[d] = 0.0
        for i in range(6):
            out[d] += J[i, d] * y[i]
