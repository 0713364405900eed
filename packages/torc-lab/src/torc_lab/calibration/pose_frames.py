"""The frame in which somebody else gives the flange's poses: the robot's base, unless it is the world."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, make_pose
from torc.robots.description import ArmDescription


@dataclass(frozen=True)
class PoseFrame:
    """A frame: how messages name it, and where it is in the world."""

    words: str = "the world frame"
    T_world_frame: Pose = field(default_factory=lambda: np.eye(4))

    @property
    def is_world(self) -> bool:
        """Whether it is the world frame by another name."""
        return bool(np.allclose(self.T_world_frame, np.eye(4)))


def base_frame(arm: ArmDescription, turn_deg: float = 0.0) -> PoseFrame:
    """Return the frame that carries the arm's first joint, turned about its z axis by so much."""
    T = arm.T_world_base @ make_pose(
        Rotation.from_euler("z", turn_deg, degrees=True).as_matrix(), np.zeros(3)
    )
    x, y, z = T[:3, 3] + 0.0
    yaw_deg = round(float(np.rad2deg(np.arctan2(T[1, 0], T[0, 0]))))
    stands = f"x {x:.3f}, y {y:.3f}, z {z:.3f} m of the world frame, turned by {yaw_deg} degrees about z"
    frame = PoseFrame(f"the robot's base frame, which stands at {stands}", T)
    return (
        replace(frame, words="the robot's base frame, which is the world frame") if frame.is_world else frame
    )
