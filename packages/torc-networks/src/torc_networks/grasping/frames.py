"""Convert the frames of grasp networks to torc's: x closing, z approach, origin between the fingertips.

Both networks have torc's axes, but an origin behind the fingertips.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from torc.grasping.hand import HandGeometry
from torc.robots.gripper import GripperDescription

PANDA_TIP_M = 0.1034
"""Distance of Contact-GraspNet's origin behind the fingertips of the Franka hand that it was trained with."""


def along_axes(
    Ts: Float[np.ndarray, "n 4 4"], offsets: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 4 4"]:
    """Move poses along their own axes: T @ translation(offset)."""
    out = Ts.copy()
    out[:, :3, 3] += np.einsum("nij,nj->ni", Ts[:, :3, :3], offsets)
    return out


def tcp_of_contact_graspnet(
    Ts_camera_hand: Float[np.ndarray, "n 4 4"], T_world_camera: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "n 4 4"]:
    """Return T_world_tcp of Contact-GraspNet's poses in the camera frame.

    The fingertips stay where the network wants those of the Franka hand, whatever the gripper.
    """
    tips = np.tile([0.0, 0.0, PANDA_TIP_M], (len(Ts_camera_hand), 1))
    return T_world_camera @ along_axes(Ts_camera_hand, tips)


def fingertips(gripper: GripperDescription, widths_m: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
    """Return the TCP in GraspGenX's base frame, per opening: the flange's origin with the TCP's axes."""
    Ts = gripper.Ts_tool0_tcp_at(widths_m)
    return np.einsum("nji,nj->ni", Ts[:, :3, :3], Ts[:, :3, 3])


def measured_widths(
    Ts_world_tcp: Float[np.ndarray, "n 4 4"], points: Float[np.ndarray, "m 3"], hand: HandGeometry
) -> Float[np.ndarray, "n"]:
    """Return the distance between the pads when one meets an object's points (world); 0 if no point is between them.

    The fingers close evenly about the grasp: if the object is off its middle, they meet one side first.
    """
    out = np.zeros(len(Ts_world_tcp))
    for k, T in enumerate(Ts_world_tcp):
        x, y, z = ((points - T[:3, 3]) @ T[:3, :3]).T
        met = (
            (np.abs(y) < hand.finger_y)
            & (z <= 0)
            & (z > -hand.finger_z)
            & (np.abs(x) <= hand.max_width_m / 2)
        )
        out[k] = 2 * np.abs(x[met]).max(initial=0.0)
    return out


def gripper_config(gripper: GripperDescription, kind: str = "parallel_2f") -> dict[str, Any]:
    """Describe a gripper as GraspGenX's config.json does, in its base frame (see `fingertips`), metres.

    The volumes that the fingers sweep are the space between the pads, open and half open.
    """
    width = gripper.max_width_m
    tip, tip_half = fingertips(gripper, np.array([width, width / 2]))
    boxes = [*gripper.finger_boxes(width), *gripper.palm_boxes(width)]
    corners = [np.array([b.center - b.half_size, b.center + b.half_size]) + tip for b in boxes]
    size = np.array([gripper.pad_width_m, gripper.pad_height_m])
    middle = np.array([0.0, 0.0, -gripper.pad_height_m / 2])
    return {
        "type": kind,
        "symmetric": True,
        "fingertip": tip.tolist(),
        "bbox": [np.min(corners, axis=(0, 1)).tolist(), np.max(corners, axis=(0, 1)).tolist()],
        "standoff": [0.0, 0.0],
        "sweep_volume": {
            "extents": [width, *size.tolist()],
            "offset": (tip + middle).tolist(),
            "extents2": [width / 2, *size.tolist()],
            "offset2": (tip_half + middle).tolist(),
        },
    }
