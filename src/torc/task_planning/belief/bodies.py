"""The objects in sight as upright boxes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt64

from torc.geometry.transforms import kernel_array
from torc.grasping.cells import thin_out
from torc.grasping.completion import assumed_body
from torc.grasping.config import CloudConfig
from torc.records import OcclusionVolume, SegmentedScene, VoxelGrid
from torc.task_planning.belief.box_kernels import Boxes, extended_down

_FEWEST_POINTS = 5


@dataclass(frozen=True)
class Bodies:
    """Boxes around the objects in sight that show enough of themselves, as arguments of `box_kernels`.

    Attributes:
        boxes: one row per object, world frame.
        bits: bit k for object id k.
    """

    ids: tuple[int, ...]
    boxes: Boxes
    bits: UInt64[np.ndarray, "m"]


def grid_frame(grid: VoxelGrid) -> Float[np.ndarray, "4"]:
    """Return a grid's frame as the kernels expect it: origin and voxel edge, metres."""
    return np.array([*grid.origin, grid.voxel_size_m], dtype=float)


def bodies_of(scene: SegmentedScene, volume: OcclusionVolume) -> Bodies:
    """Return the boxes that the objects in sight are assumed to fill, by the grasp planner's `assumed_body`.

    A box whose lower end is out of sight extends down through unseen space to the support or the next body, since most
    things stand on something.
    """
    config, support_z_m = CloudConfig(), float(volume.grid.origin[2])
    camera = np.asarray(scene.observation.T_world_camera, dtype=float)[:3, 3]
    ids: list[int] = []
    rows: list[Float[np.ndarray, 8]] = []
    for o in scene.objects:
        if len(o.points) < _FEWEST_POINTS:
            continue
        points, _ = thin_out(o.points, o.normals, config.voxel_m)
        body = assumed_body(points, np.asarray(o.felt, dtype=float), camera, support_z_m, config)
        ids.append(o.id)
        rows.append(np.array([*body.center, *body.size_m / 2, *body.view[:2]]))
    boxes = np.array(rows, dtype=float).reshape(len(rows), 8)
    if len(boxes):
        boxes = extended_down(
            kernel_array(boxes), kernel_array(volume.seen, np.bool_), grid_frame(volume.grid)
        )
    bits = np.array([1 << k for k in ids], dtype=np.uint64)
    return Bodies(tuple(ids), boxes, bits)
