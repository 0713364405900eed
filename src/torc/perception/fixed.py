"""What is always there is no object: masks of the workspace's own walls, shelves and other obstacles."""

import numpy as np
from jaxtyping import Bool, Float, Int16

from torc.geometry.transforms import unproject
from torc.perception.embedded.region import NOISE, support_roughness
from torc.perception.segmentation import PerceptionConfig, valid_depth
from torc.records import Observation
from torc.workspace.description import Workspace

_NEAR_M = 0.006
"""What is read this close to an obstacle, or inside it, shows the obstacle; with rough depth, farther off."""
_MOST = 0.5
"""A mask is no object if it shows obstacles with a larger share of its readings."""


def without_fixed(
    label: Int16[np.ndarray, "h w"], observation: Observation, workspace: Workspace, config: PerceptionConfig
) -> Int16[np.ndarray, "h w"]:
    """The masks without those that mostly show the workspace's obstacles. -1 is no mask; the other numbers stay. A
    picture whose pose was made up shows another world, in which nobody knows of obstacles.
    """
    if not workspace.obstacles or observation.pose_estimated:
        return label
    depth_m = valid_depth(observation.depth_m, config.min_depth_m, config.max_depth_m)
    rows, cols = np.nonzero(depth_m > 0)
    points = unproject(
        rows, cols, depth_m[rows, cols].astype(float), observation.K, observation.T_world_camera
    )
    near_m = max(_NEAR_M, NOISE * support_roughness(points[:, 2] - workspace.support_z_m))
    shown = label[rows, cols]
    masked, count = shown >= 0, int(label.max(initial=-1)) + 1
    readings = np.bincount(shown[masked], minlength=count)
    on_them = np.bincount(shown[masked & _on_obstacles(points, workspace, near_m)], minlength=count)
    fixed = np.flatnonzero(on_them > _MOST * readings)
    return np.where(np.isin(label, fixed), np.int16(-1), label)


def _on_obstacles(
    points: Float[np.ndarray, "n 3"], workspace: Workspace, near_m: float
) -> Bool[np.ndarray, "n"]:
    found = np.zeros(len(points), bool)
    for box in workspace.obstacles:
        reach = np.array(box.size) / 2 + near_m
        found |= (np.abs(points - box.center) <= reach).all(axis=1)
    return found
