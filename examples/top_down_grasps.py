"""A grasp planner of one's own: a class with one method.

cd examples
torc run --grasps top_down_grasps:TopDown
"""

import numpy as np

from torc.protocols import GraspSet, GripperDescription, OcclusionVolume, SegmentedObject, SegmentedScene

DEPTHS_M = (0.015, 0.03)
CLEARANCE_M = 0.01


class TopDown:
    """Straight down onto the middle of each object, across its narrow side as seen from above."""

    def __init__(self, gripper: GripperDescription, support_z_m: float) -> None:
        self.max_width_m, self.support_z_m = gripper.max_width_m, support_z_m

    def plan(self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator) -> GraspSet:
        """A grasp per depth for every object that the gripper can span; the deeper one first."""
        grasps = [g for o in scene.objects if o.pixel_count > 60 for g in self._grasps_of(o)]
        Ts = np.array([T for _, T, _, _ in grasps]).reshape(-1, 4, 4)
        widths = np.array([width for _, _, width, _ in grasps], dtype=float)
        half = 0.5 * widths[:, None] * Ts[:, :3, 0]
        return GraspSet(
            Ts_world_tcp=Ts,
            widths_m=widths,
            scores=np.array([score for _, _, _, score in grasps], dtype=float),
            object_ids=np.array([k for k, _, _, _ in grasps], dtype=np.int16),
            contacts=np.stack([Ts[:, :3, 3] - half, Ts[:, :3, 3] + half], axis=1),
            generators=np.zeros(len(grasps), dtype=np.uint8),
            generator_names=("top down",),
        )

    def _grasps_of(self, seen: SegmentedObject) -> list[tuple[int, np.ndarray, float, float]]:
        """(object, T_world_tcp, width, score) of each grasp; x of the grasp frame closes, z approaches."""
        points = seen.points.astype(float)
        if len(points) < 3:
            return []
        middle = points[:, :2].mean(axis=0)
        closing = np.linalg.eigh(np.cov((points[:, :2] - middle).T))[1][:, 0]
        along = (points[:, :2] - middle) @ closing
        width = float(along.max() - along.min())
        if width > self.max_width_m - CLEARANCE_M:
            return []
        x, z = np.array([*closing, 0.0]), np.array([0.0, 0.0, -1.0])
        T = np.eye(4)
        T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
        T[:2, 3] = middle + 0.5 * (along.max() + along.min()) * closing
        top = float(points[:, 2].max())
        found = []
        for depth in sorted(DEPTHS_M, reverse=True):
            lower = T.copy()
            lower[2, 3] = max(top - depth, self.support_z_m + CLEARANCE_M)
            found.append((seen.id, lower, width, 0.5 if depth == max(DEPTHS_M) else 0.4))
        return found
