"""Describe a robot to the rest of the system: numbers only, derived from an MJCF file and a YAML beside it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from torc.geometry.transforms import Pose
from torc.robots.gripper import GripperDescription

Qpos = Float[np.ndarray, "dof"]
"""Positions of an arm's joints, radians."""


@dataclass(frozen=True, eq=False)
class ArmDescription:
    """A serial arm with hinge joints.

    Its arrays never change, since what is computed from them is kept: make another one with `dataclasses.replace`.

    T_world_link[i] = T_world_link[i-1] @ Ts_parent_joint[i] @ rotation(axes[i], qpos[i]), from T_world_base.

    Attributes:
        Ts_parent_joint: joint frame in the previous link's frame (joint 0: in the base frame) at q = 0.
        axes: unit rotation axis in the joint frame.
        T_world_base: the frame that carries joint 0.
        rest_qpos: where the arm waits, radians; out of the camera's sight.
    """

    joint_names: tuple[str, ...]
    Ts_parent_joint: Float[np.ndarray, "dof 4 4"]
    axes: Float[np.ndarray, "dof 3"]
    T_world_base: Pose
    T_last_tool0: Pose
    lower: Qpos
    upper: Qpos
    max_speed: Float[np.ndarray, "dof"]
    max_acceleration: Float[np.ndarray, "dof"]
    rest_qpos: Qpos

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joint_names)


@dataclass(frozen=True)
class SphereModel:
    """The moving robot as spheres, for batched collision checks.

    Attributes:
        link: the link that each sphere moves with: 0..dof-1 the link of that joint, dof the gripper's body (tool0
            frame), dof+1 / dof+2 the finger at -x / +x.
        centers: in that link's frame; a finger's in the TCP frame at the current opening as if the opening were 0, to
            be shifted along x by -/+ half the opening.
        radii: metres; unpadded.
    """

    link: Int[np.ndarray, "s"]
    centers: Float[np.ndarray, "s 3"]
    radii: Float[np.ndarray, "s"]

    def __len__(self) -> int:
        return len(self.radii)


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """A robot: arm, gripper, shape, and their names in the MJCF.

    Its arrays never change, since what is computed from them is kept: make another one with `dataclasses.replace`.

    Attributes:
        static_spheres: x, y, z, radius in the world frame, of the parts that do not move.
        self_pairs: pairs of link numbers (as in SphereModel.link) that can touch each other.
        static_links: link numbers that can touch the static spheres.
        mjcf_path: the model, a fragment without floor, light, camera or physics options.
        arm_actuator_names: position servos, in the order of arm.joint_names; command = joint position, radians.
        gripper_body_name: the body that carries the fingers; its subtree is the whole gripper.
        pad_geom_names, tip_site_names: of the finger at -x and at +x; tips are in the middle of a pad's distal edge.
        root_body_names: the bodies at the root of the MJCF; their subtrees are the whole robot.
        source: fingerprint of the content of its files.
    """

    name: str
    arm: ArmDescription
    gripper: GripperDescription
    spheres: SphereModel
    static_spheres: Float[np.ndarray, "k 4"]
    self_pairs: Int[np.ndarray, "m 2"]
    static_links: tuple[int, ...]
    mjcf_path: Path
    arm_actuator_names: tuple[str, ...]
    gripper_actuator_name: str
    gripper_body_name: str
    finger_body_names: tuple[str, str]
    pad_geom_names: tuple[tuple[str, ...], tuple[str, ...]]
    tip_site_names: tuple[str, str]
    tool0_site_name: str
    root_body_names: tuple[str, ...]
    source: str
