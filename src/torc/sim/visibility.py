"""What is true of a scene: how many pixels of each object a camera sees, what hides the rest, which voxels are full.

Pixels are counted by rays, never by GL, so that the counts are equal on every machine.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Bool, Float, Int, Int16

from torc.geometry.transforms import make_pose, project, rotation_from_wxyz, transform_points
from torc.records import BACKGROUND
from torc.sim.raycasting import cast, pixel_directions
from torc.sim.simulated_world import Presence, World, restore_state, save_state
from torc.workspace.description import CameraMount

_FAR_M = 30.0
_NEAR_M = 0.02
_MARGIN_PX = 2


@dataclass(frozen=True)
class Visibility:
    """Pixels of each object in one camera's image, and with all other objects removed; and [k, j] the pixels in which
    object k would show alone, and object j shows in its place.
    """

    pixels: Int[np.ndarray, "n"]
    pixels_alone: Int[np.ndarray, "n"]
    hidden_by: Int[np.ndarray, "n n"]

    @property
    def fractions(self) -> Float[np.ndarray, "n"]:
        """Visible share of each object, 0..1; 0 for an object outside the image."""
        return self.pixels / np.maximum(self.pixels_alone, 1)


def measure_visibility(
    world: World, mount: CameraMount, label_image: Int16[np.ndarray, "h w"] | None = None
) -> Visibility:
    """Count the pixels of every object in the scene, and alone; the robot hides objects too.

    The world is unchanged afterwards. `label_image` is the camera's present image by rays, if it exists already.
    """
    count, present = world.object_count, [int(i) for i in np.flatnonzero(world.present)]
    windows = {i: _window(world, i, mount) for i in present}
    around = np.any([*windows.values(), np.zeros((mount.height, mount.width), bool)], axis=0)
    seen = _labels(world, mount, around) if label_image is None else label_image
    alone, hidden_by = np.zeros(count, dtype=np.int64), np.zeros((count, count), dtype=np.int64)
    state, positions, wxyz = save_state(world), world.positions, world.wxyz
    for i in present:
        world.park(i, Presence.DROPPED)
    for i in present:
        world.unpark(i, positions[i], wxyz[i])
        # Where an object shows in the scene it also shows alone: no rays there.
        shows = seen == i
        hidden = _labels(world, mount, windows[i] & ~shows) == i
        alone[i] = np.count_nonzero(shows) + np.count_nonzero(hidden)
        hidden_by[i] = _counts(seen[hidden], count)
        world.park(i, Presence.DROPPED)
    restore_state(world, state)
    return Visibility(_counts(seen, count), alone, hidden_by)


def _counts(labels: Int16[np.ndarray, "..."], objects: int) -> Int[np.ndarray, "n"]:
    return np.bincount(labels[labels >= 0].astype(np.int64), minlength=objects)


def _labels(world: World, mount: CameraMount, asked: Bool[np.ndarray, "h w"]) -> Int16[np.ndarray, "h w"]:
    """Return the object id per pixel where it is asked for; BACKGROUND elsewhere."""
    labels = np.full(asked.shape, BACKGROUND, np.int16)
    if asked.any():
        world.update_kinematics()
        rays = pixel_directions(mount.K, mount.width, mount.height)[asked.ravel()]
        _, geoms, _ = cast(world.model, world.data, mount.T_world_camera, rays, _FAR_M)
        # Geom -1 (nothing) reads the last entry.
        labels[asked] = np.append(world.geom_labels, np.int16(BACKGROUND))[geoms]
    return labels


def _window(world: World, object_id: int, mount: CameraMount) -> Bool[np.ndarray, "h w"]:
    """Return the pixels in which an object can be: around the bounding box of its visible surfaces."""
    vertices = np.concatenate([mesh.vertices for mesh in world.models[object_id].visuals])
    corners = np.array(list(product(*zip(vertices.min(axis=0), vertices.max(axis=0)))), dtype=float)
    T = make_pose(rotation_from_wxyz(world.wxyz[object_id]), world.positions[object_id])
    cols, rows, depth = project(transform_points(T, corners), mount.K, mount.T_world_camera)
    if depth.min() < _NEAR_M:
        return np.ones((mount.height, mount.width), dtype=bool)
    inside = np.zeros((mount.height, mount.width), dtype=bool)
    low = np.floor([rows.min(), cols.min()]) - _MARGIN_PX
    high = np.ceil([rows.max(), cols.max()]) + _MARGIN_PX + 1
    (top, left), (bottom, right) = np.clip([low, high], 0, inside.shape).astype(int)
    inside[top:bottom, left:right] = True
    return inside


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
