"""Forward kinematics of an arm, batched."""

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, kernel_array
from torc.robots.description import ArmDescription, RobotDescription
from torc.robots.kinematics_kernels import link_poses_kernel


def link_poses(arm: ArmDescription, qpos: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n links 4 4"]:
    """Return world poses of the dof links and, last, of tool0. Raises ValueError for another number of joints."""
    q = kernel_array(qpos)
    if q.ndim != 2 or q.shape[1] != arm.dof:
        raise ValueError(f"qpos must be (n, {arm.dof}); it is {np.shape(qpos)}.")
    out = np.empty((len(q), arm.dof + 1, 4, 4))
    link_poses_kernel(arm.T_world_base, arm.Ts_parent_joint, arm.axes, arm.T_last_tool0, q, out)
    return out


def tool0_poses(arm: ArmDescription, qpos: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n 4 4"]:
    """Return world poses of the flange."""
    return link_poses(arm, qpos)[:, -1]


def tcp_pose(robot: RobotDescription, q: Float[np.ndarray, "dof"], width_m: float) -> Pose:
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
