"""Forward kinematics of an arm, batched."""

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, invert
from torc.robots.description import ArmDescription, GripperDescription, RobotDescription
from torc.robots.kernels import (
    jacobian_kernel,
    link_poses_kernel,
    multiply_affine,
    rotate_about,
    sphere_centers_batch_kernel,
    sphere_centers_kernel,
    tcp_pose_kernel,
)

__all__ = [
    "jacobian",
    "jacobian_kernel",
    "link_poses",
    "link_poses_kernel",
    "multiply_affine",
    "rotate_about",
    "sphere_centers",
    "sphere_centers_batch_kernel",
    "sphere_centers_kernel",
    "tcp_pose",
    "tcp_pose_kernel",
    "tool0_from_tcp",
    "tool0_poses",
]


def link_poses(arm: ArmDescription, qpos: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n links 4 4"]:
    """World poses of the dof links and, last, of tool0. Raises ValueError for another number of joints."""
    q = np.ascontiguousarray(qpos, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != arm.dof:
        raise ValueError(f"qpos must be (n, {arm.dof}); it is {np.shape(qpos)}.")
    out = np.empty((len(q), arm.dof + 1, 4, 4))
    link_poses_kernel(arm.T_world_base, arm.Ts_parent_joint, arm.axes, arm.T_last_tool0, q, out)
    return out


def tool0_poses(arm: ArmDescription, qpos: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n 4 4"]:
    """World poses of the flange."""
    return link_poses(arm, qpos)[:, -1]


def jacobian(arm: ArmDescription, q: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "6 dof"]:
    """Velocity of tool0 per joint velocity, world frame: three linear rows, then three angular."""
    out = np.empty((6, arm.dof))
    jacobian_kernel(link_poses(arm, np.asarray(q)[None])[0], arm.axes, out)
    return out


def tool0_from_tcp(
    gripper: GripperDescription, Ts_world_tcp: Float[np.ndarray, "n 4 4"], width_m: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n 4 4"]:
    """Flange poses that put the TCP at Ts_world_tcp at those openings."""
    inverses = np.array([invert(gripper.T_tool0_tcp(float(w))) for w in width_m]).reshape(-1, 4, 4)
    return np.asarray(Ts_world_tcp, dtype=np.float64) @ inverses


def tcp_pose(robot: RobotDescription, q: Float[np.ndarray, "dof"], width_m: float) -> Pose:
    """World pose of the TCP of one configuration."""
    return tool0_poses(robot.arm, np.asarray(q)[None])[0] @ robot.gripper.T_tool0_tcp(width_m)


def sphere_centers(
    robot: RobotDescription, qpos: Float[np.ndarray, "n dof"], width_m: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n s 3"]:
    """World centres of robot.spheres, per configuration and opening of the gripper."""
    poses = link_poses(robot.arm, qpos)
    widths = np.ascontiguousarray(np.broadcast_to(np.asarray(width_m, dtype=np.float64), len(poses)))
    out = np.empty((len(poses), len(robot.spheres), 3))
    gripper, spheres = robot.gripper, robot.spheres
    sphere_centers_batch_kernel(
        poses, widths, gripper.widths_m, gripper.Ts_tool0_tcp, spheres.link, spheres.centers, out
    )
    return out
