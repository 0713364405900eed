"""Describe the space that a motion must keep to for a server, in the words of cuRobo 0.8 ("v2")."""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy.ndimage import distance_transform_edt

from torc.collision.collision_world import FREE
from torc.collision.placement import RobotArrays
from torc.motion.space import FreeSpace

_FAR_M = 10.0


def voxel_esdf(
    occupied: Bool[np.ndarray, "nx ny nz"], voxel_size_m: float
) -> Float32[np.ndarray, "nx ny nz"]:
    """Return the signed distance of each voxel's centre, metres: negative inside occupied voxels; 10 at most.

    That is cuRobo's sign from 0.8 on; before, it was the other one. The surface lies half a voxel from the centres on
    either side of it.
    """
    if occupied.all() or not occupied.any():
        return np.full(occupied.shape, -_FAR_M if occupied.any() else _FAR_M, np.float32)
    outside, inside = distance_transform_edt(~occupied), distance_transform_edt(occupied)
    signed = np.where(occupied, 0.5 - inside, outside - 0.5) * voxel_size_m
    return np.clip(signed, -_FAR_M, _FAR_M).astype(np.float32)


def attached_spheres(robot: RobotArrays) -> Float[np.ndarray, "a 4"]:
    """Return the spheres in the hand: x, y, z and radius in the tool0 frame."""
    links = len(robot.axes) + 3
    if len(robot.link_start) == links + 1:
        return np.zeros((0, 4))
    own = slice(robot.link_start[links], robot.link_start[links + 1])
    return np.column_stack([robot.centers[own], robot.radii[own]])


def world_fields(space: FreeSpace) -> dict[str, Any]:
    """Return the fields of a request that describe the world; metres, world frame.

    esdf (nx, ny, nz), voxel_size and pose (of the grid's centre, x y z qw qx qy qz) are the voxels; boxes (b, 6) lowest
    and highest corners; padding (3, 2) is of arm, gripper and what is held, against voxels and boxes, self_padding
    within the robot; width is the opening, attached (a, 4) what is held, in the tool0 frame.
    """
    world = space.world
    centre = world.origin + 0.5 * world.voxel_size_m * np.array(world.kind.shape)
    return {
        "esdf": voxel_esdf(world.kind != FREE, world.voxel_size_m),
        "voxel_size": world.voxel_size_m,
        "pose": np.array([*centre, 1.0, 0.0, 0.0, 0.0]),
        "boxes": world.boxes,
        "padding": world.padding,
        "self_padding": world.self_padding,
        "width": space.width_m,
        "attached": attached_spheres(space.robot),
    }
