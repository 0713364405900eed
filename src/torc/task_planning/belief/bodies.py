"""The objects in sight as upright boxes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt64

from torc.grasping.cells import thin_out
from torc.grasping.completion import assumed_body
from torc.grasping.config import CloudConfig
from torc.records import SegmentedScene
from torc.task_planning.belief.box_kernels import Boxes

_FEWEST_POINTS = 5


@dataclass(frozen=True)
class Bodies:
    """Boxes around the objects in sight, as far as they show enough: what `box_kernels` take.

    Attributes:
        boxes: one row per object, world frame.
        bits: bit k for object id k.
    """

    ids: tuple[int, ...]
    boxes: Boxes
    bits: UInt64[np.ndarray, "m"]


def bodies_of(scene: SegmentedScene, support_z_m: float, config: CloudConfig | None = None) -> Bodies:
    """The boxes that the objects in sight are taken to fill, as the grasp planner takes them (`assumed_body`)."""
    config = CloudConfig() if config is None else config
    camera = np.asarray(scene.observation.T_world_camera, dtype=float)[:3, 3]
    ids: list[int] = []
    rows: list[Float[np.ndarray, "8"]] = []
    for o in scene.objects:
        if len(o.points) < _FEWEST_POINTS:
            continue
        points, _ = thin_out(o.points, o.normals, config.voxel_m)
        body = assumed_body(points, np.asarray(o.felt, dtype=float), camera, support_z_m, config)
        ids.append(o.id)
        rows.append(np.array([*body.center, *body.size_m / 2, *body.view[:2]]))
    boxes = np.array(rows, dtype=float).reshape(len(rows), 8)
    bits = np.array([1 << k for k in ids], dtype=np.uint64)
    return Bodies(tuple(ids), boxes, bits)
