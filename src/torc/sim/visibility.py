"""Count how many pixels of each object a camera sees, and what hides the rest.

Always by rays, never by GL, so that the counts are equal on every machine.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Bool, Float, Int, Int16

from torc.geometry.transforms import make_pose, project, rotation_from_wxyz, transform_points
from torc.records import BACKGROUND
from torc.sim.raycasting import cast, pixel_directions
from torc.sim.simulated_world import Presence, World
from torc.sim.state import restore_state, save_state
from torc.workspace.description import CameraMount

_FAR_M = 30.0
_NEAR_M = 0.02
_MARGIN_PX = 2

_Window = tuple[int, int, int, int]
"""First and last row (exclusive), first and last column (exclusive)."""


@dataclass(frozen=True)
class Visibility:
    """Pixels of each object in one camera's image.

    Attributes:
        pixels_alone: with all other objects removed.
        hidden_by: [k, j]: pixels in which object k would show alone, and object j shows in its place.
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
    windows = [_window(world, i, mount) for i in range(world.object_count)]
    present = [int(i) for i in np.flatnonzero(world.present)]
    around = _around([windows[i] for i in present])
    seen = _labels(world, mount, around) if label_image is None else label_image
    alone = np.zeros(world.object_count, dtype=np.int64)
    hidden_by = np.zeros((world.object_count, world.object_count), dtype=np.int64)
    state, positions, wxyz = save_state(world), world.positions, world.wxyz
    for i in present:
        world.park(i, Presence.DROPPED)
    for i in present:
        world.unpark(i, positions[i], wxyz[i])
        # Where an object shows in the scene it also shows alone: no rays there.
        shows = seen == i
        hidden = _labels(world, mount, windows[i], skip=shows) == i
        alone[i] = np.count_nonzero(shows) + np.count_nonzero(hidden)
        hidden_by[i] = _counts(seen[hidden], world.object_count)
        world.park(i, Presence.DROPPED)
    restore_state(world, state)
    return Visibility(_counts(seen, world.object_count), alone, hidden_by)


def _counts(labels: Int16[np.ndarray, "..."], objects: int) -> Int[np.ndarray, "n"]:
    """Count each object's labels."""
    return np.bincount(labels[labels >= 0].astype(np.int64), minlength=objects)


def _labels(
    world: World, mount: CameraMount, window: _Window, skip: Bool[np.ndarray, "h w"] | None = None
) -> Int16[np.ndarray, "h w"]:
    """Return the object id per pixel in a window of the image; BACKGROUND outside and where rays are skipped."""
    labels = np.full((mount.height, mount.width), BACKGROUND, np.int16)
    top, bottom, left, right = window
    wanted = np.zeros(labels.shape, dtype=bool)
    wanted[top:bottom, left:right] = True if skip is None else ~skip[top:bottom, left:right]
    if wanted.any():
        world.update_kinematics()
        rays = pixel_directions(mount.K, mount.width, mount.height)[wanted.ravel()]
        _, geoms, _ = cast(world.model, world.data, mount.T_world_camera, rays, _FAR_M)
        # Geom -1 (nothing) reads the last entry.
        labels[wanted] = np.append(world.geom_labels, np.int16(BACKGROUND))[geoms]
    return labels


def _window(world: World, object_id: int, mount: CameraMount) -> _Window:
    """Return the part of the image in which an object can be: around the bounding box of its visible surfaces."""
    vertices = np.concatenate([mesh.vertices for mesh in world.models[object_id].visuals])
    corners = np.array(list(product(*zip(vertices.min(axis=0), vertices.max(axis=0)))), dtype=float)
    T = make_pose(rotation_from_wxyz(world.wxyz[object_id]), world.positions[object_id])
    cols, rows, depth = project(transform_points(T, corners), mount.K, mount.T_world_camera)
    if depth.min() < _NEAR_M:
        return 0, mount.height, 0, mount.width
    return (*_span(rows, mount.height), *_span(cols, mount.width))


def _span(values: Float[np.ndarray, "n"], size: int) -> tuple[int, int]:
    low = int(np.clip(np.floor(values.min()) - _MARGIN_PX, 0, size))
    high = int(np.clip(np.ceil(values.max()) + _MARGIN_PX + 1, 0, size))
    return low, high


def _around(windows: list[_Window]) -> _Window:
    if not windows:
        return 0, 0, 0, 0
    tops, bottoms, lefts, rights = zip(*windows)
    return min(tops), max(bottoms), min(lefts), max(rights)
