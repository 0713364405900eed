"""Remember what the fingers touched where nothing was seen.

An approach that ends in an unexpected contact means that something is where a fingertip is. Usually that is the unseen
back of the object, which reaches further than assumed. The end of that finger counts as felt points of the object while
it stays where it was, so that grasp planners avoid it.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, transform_points
from torc.pipeline.failures import FailedGrasp
from torc.records import OcclusionVolume, SegmentedScene, Touch
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.robots.kinematics import tcp_pose

_SPACING_M = 0.003
"""Distance of touched points: finer than grasp planners thin clouds out to."""
_INSIDE_M = 0.004
"""Touched points lie this far inside the surface, so that voxels seen up to it do not rule them out."""


def touched_points(
    touch: Touch | None, robot: RobotDescription, volume: OcclusionVolume
) -> Float[np.ndarray, "n 3"]:
    """Return points on the end of the finger that touched something, where nothing was seen to be free; world frame.

    The finger is the one with more of these points: no arm feels which one it was.
    """
    if touch is None:
        return np.zeros((0, 3))
    width_m = min(touch.width_m, robot.gripper.max_width_m)
    T_world_tcp = tcp_pose(robot, np.array(touch.qpos), width_m)
    ahead = (touch.relief_m + _INSIDE_M) * T_world_tcp[:3, 2]
    ends = [end + ahead for end in finger_ends(T_world_tcp, robot.gripper, width_m)]
    hidden = [e[volume.grid.contains(volume.grid.index_of(e)) & ~volume.free_at(e)] for e in ends]
    return max(hidden, key=len)


def finger_ends(
    T_world_tcp: Pose, gripper: GripperDescription, width_m: float
) -> list[Float[np.ndarray, "n 3"]]:
    """Return a grid of points on the leading face of each of the two fingers, world frame."""
    ends = []
    for box in gripper.finger_boxes(width_m):
        x, y = (
            np.linspace(c - h, c + h, int(np.ceil(2 * h / _SPACING_M)) + 1)
            for c, h in zip(box.center[:2], box.half_size[:2])
        )
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        end = np.column_stack([grid, np.full(len(grid), box.center[2] + box.half_size[2])])
        ends.append(transform_points(T_world_tcp, end))
    return ends


def with_touched(scene: SegmentedScene, failed: tuple[FailedGrasp, ...]) -> SegmentedScene:
    """Return the scene as seen and felt, given the failures that still count."""
    touched = [(f.object_id, f.touched.astype(np.float32)) for f in failed if len(f.touched)]
    if not touched:
        return scene
    objects = [
        replace(o, felt=np.concatenate([o.felt, *(points for k, points in touched if k == o.id)]))
        for o in scene.objects
    ]
    return replace(scene, objects=tuple(objects))
