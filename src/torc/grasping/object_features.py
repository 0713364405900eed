"""What is measured of an object once for all its candidates."""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.grasping.cells import PointCells
from torc.grasping.clouds import ObjectCloud

OBJECT_FEATURES = {
    "depth": "estimated extent along the viewing direction",
    "breadth": "extent across the viewing direction",
    "height": "extent along the vertical",
    "seen_depth_share": "share of the estimated depth that was seen",
    "bottom_height": "height of the object's lowest point above the support",
    "log_points": "log(1 + seen points)",
    "log_pixels": "log(1 + pixels of the mask)",
    "log_foreign_above": "log(1 + points of other objects above it)",
    "log_foreign_touching": "log(1 + points of other objects within 8 mm of its seen points)",
    "flatness": "least over middle principal extent of its seen points",
    "roundness": "spread of its seen normals: 0 one plane .. 1 all directions alike",
    "camera_distance": "from the camera to its centre",
}
_COLUMN_M = 0.01
_TOUCH_M = 0.008


def object_features(
    cloud: ObjectCloud, cells: PointCells, support_z_m: float, camera_position: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "f"]:
    """Values in the order of OBJECT_FEATURES."""
    seen, normals = cloud.points[: cloud.visible], cloud.normals[: cloud.visible]
    low, high = seen.min(axis=0), seen.max(axis=0)
    near = (cells.tags != cloud.id) & np.all(
        (cells.points > low - _TOUCH_M) & (cells.points[:, :] < high + np.array([_TOUCH_M, _TOUCH_M, 1.0])),
        axis=1,
    )
    above, touching = _neighbours(seen, cells.points[near], low, _COLUMN_M, _TOUCH_M)
    extents = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(seen.T)), 0.0)) if len(seen) > 2 else np.zeros(3)
    spread = np.linalg.eigvalsh(normals.T @ normals / max(len(normals), 1))
    done = cloud.completion
    return np.array(
        [
            *done.size_m,
            min(1.0, done.seen_depth_m / max(done.size_m[0], 1e-6)),
            done.center[2] - done.size_m[2] / 2 - support_z_m,
            np.log1p(cloud.visible),
            np.log1p(cloud.pixel_count),
            np.log1p(above),
            np.log1p(touching),
            extents[0] / max(extents[1], 1e-6),
            1.5 * (1.0 - spread[2] / max(spread.sum(), 1e-9)),
            np.linalg.norm(done.center - camera_position),
        ]
    )


@njit(cache=True)
def _neighbours(
    own: np.ndarray, others: np.ndarray, low: np.ndarray, column_m: float, touch_m: float
) -> tuple[int, int]:
    """Others' points above the own ones (in 1 cm columns), and others' points that come close to an own one."""
    nx = int((own[:, 0].max() - low[0]) / column_m) + 1
    ny = int((own[:, 1].max() - low[1]) / column_m) + 1
    top = np.full((nx, ny), 1e9)
    for p in own:
        i, j = int((p[0] - low[0]) / column_m), int((p[1] - low[1]) / column_m)
        if top[i, j] > 1e8 or p[2] > top[i, j]:
            top[i, j] = p[2]
    above, touching = 0, 0
    for q in others:
        if q[0] >= low[0] and q[1] >= low[1]:
            i, j = int((q[0] - low[0]) / column_m), int((q[1] - low[1]) / column_m)
            if i < nx and j < ny and q[2] > top[i, j]:
                above += 1
        for p in own:
            dx, dy, dz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
            if dx * dx + dy * dy + dz * dz < touch_m * touch_m:
                touching += 1
                break
    return above, touching
