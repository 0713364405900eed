"""What the fingers touched where nothing was seen.

An approach that ends in an unexpected contact says that something is where a fingertip is. As a rule that is the back
of the object, which nobody saw, and which reaches further than it was taken to. The end of such a finger counts as
felt points of the object for as long as that lies where it was, for grasp planners to go around.
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
"""Distance of touched points: closer than those that grasp planners thin clouds out to."""
_INSIDE_M = 0.004
"""They lie this far inside what was touched, so that voxels that were seen up to its surface do not deny them."""


def touched_points(
    touch: Touch | None, robot: RobotDescription, volume: OcclusionVolume
) -> Float[np.ndarray, "n 3"]:
    """Points on the end of the finger that touched something, as far as they lie where nothing was seen to be free;
    world frame. That finger is the one of which more does: no arm feels which one it was.
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
    """A grid of points on the face with which each of the two fingers arrives, world frame."""
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
    """The scene as seen and felt, by the failures that still tell something."""
    touched = [(f.object_id, f.touched.astype(np.float32)) for f in failed if len(f.touched)]
    if not touched:
        return scene
    objects = [
        replace(o, felt=np.concatenate([o.felt, *(points for k, points in touched if k == o.id)]))
        for o in scene.objects
    ]
    return replace(scene, objects=tuple(objects))
