"""Voxel grids and the occlusion volume."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16, UInt64

EMPTY = -128
"""Surface label of a voxel that holds no surface point."""


@dataclass(frozen=True)
class VoxelGrid:
    """An axis-aligned grid in the world frame.

    Attributes:
        origin: lowest corner of voxel (0, 0, 0), metres.
        voxel_size_m: edge length.
        shape: number of voxels along x, y, z.
    """

    origin: Float[np.ndarray, "3"]
    voxel_size_m: float
    shape: tuple[int, int, int]

    @property
    def upper(self) -> Float[np.ndarray, "3"]:
        """Highest corner of the grid, metres."""
        return self.origin + self.voxel_size_m * np.asarray(self.shape)

    def centers(self) -> Float[np.ndarray, "nx ny nz 3"]:
        """Return the centres of all voxels, world frame."""
        axes = [o + self.voxel_size_m * (np.arange(n) + 0.5) for o, n in zip(self.origin, self.shape)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)

    def index_of(self, points: Float[np.ndarray, "*n 3"]) -> np.ndarray:
        """Return the voxel index (int64) of each point; it may lie outside the grid."""
        return np.floor((points - self.origin) / self.voxel_size_m).astype(np.int64)

    def contains(self, index: np.ndarray) -> np.ndarray:
        """Return, per voxel index, whether it lies within the grid."""
        return np.all((index >= 0) & (index < np.asarray(self.shape)), axis=-1)


@dataclass(frozen=True)
class OcclusionVolume:
    """The space that was never seen, and the objects that hide it (paper: Perception).

    Attributes:
        seen: voxels that some snapshot saw free or on a surface.
        hidden_by: per unseen voxel the objects that hide it in the latest snapshot, bit k for object id k; 0 for seen
            voxels and for those hidden by nothing that has an id.
        surface_label: object id (or BACKGROUND) of the surface points in the latest snapshot; EMPTY elsewhere.
    """

    grid: VoxelGrid
    seen: Bool[np.ndarray, "nx ny nz"]
    hidden_by: UInt64[np.ndarray, "nx ny nz"]
    surface_label: Int16[np.ndarray, "nx ny nz"]
    snapshots: int

    def free_at(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
        """Return, per point (world frame), whether its voxel was seen and holds no surface; False outside the grid."""
        index = self.grid.index_of(points)
        inside = self.grid.contains(index)
        at = tuple(index[inside].T)
        free = np.zeros(len(points), dtype=bool)
        free[inside] = self.seen[at] & (self.surface_label[at] == EMPTY)
        return free

    def hidden_volume_m3(self, object_id: int) -> float:
        """Return the volume of the unseen voxels that this object hides, cubic metres."""
        bit = np.uint64(1) << np.uint64(object_id)
        return float(np.count_nonzero(self.hidden_by & bit)) * self.grid.voxel_size_m**3
