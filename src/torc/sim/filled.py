"""Find the voxels of the watched region that the objects fill, where nothing else can be."""

import numpy as np
from jaxtyping import Bool

from torc.geometry.transforms import rotation_from_wxyz
from torc.sim.simulated_world import World


def filled_voxels(world: World) -> Bool[np.ndarray, "nx ny nz"]:
    """Return the voxels of the watched region whose middles lie within the objects present."""
    grid = world.workspace.grid
    full = np.zeros(grid.shape, dtype=bool)
    for i in np.flatnonzero(world.present):
        R, position = rotation_from_wxyz(world.wxyz[i]), world.positions[i]
        for piece in world.models[i].pieces:
            reach = np.stack([-piece.support(-np.eye(3) @ R), piece.support(np.eye(3) @ R)]) + position
            low, high = np.clip(grid.index_of(reach) + np.array([[0], [1]]), 0, grid.shape)
            axes = [np.arange(a, b) for a, b in zip(low, high)]
            index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            centers = grid.origin + grid.voxel_size_m * (index + 0.5)
            full[tuple(index[piece.contains((centers - position) @ R)].T)] = True
    return full
