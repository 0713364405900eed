"""How much of each object a camera sees, and what hides the rest of it, counted in pixels.

By rays and never by GL, so that the counts are the same on every machine; only where objects can be, so that it costs
no more than a picture by GL does. The two agree on all but a few pixels of an image.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, Int16

from torc.geometry.transforms import invert, make_pose, rotation_from_wxyz, transform_points
from torc.objects.models import ObjectModel
from torc.records import BACKGROUND
from torc.sim.raycasting import cast, pixel_directions
from torc.sim.state import restore_state, save_state
from torc.sim.world import Presence, World
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
        pixels: in the scene as it is.
        pixels_alone: with all other objects taken away.
        hidden_by: [k, j]: pixels in which object k would show alone, and object j shows in its place. What is in front
            counts, not what stands between the two.
    """

    pixels: Int[np.ndarray, "n"]
    pixels_alone: Int[np.ndarray, "n"]
    hidden_by: Int[np.ndarray, "n n"]

    @property
    def fractions(self) -> Float[np.ndarray, "n"]:
        """Visible share of each object, 0..1; 0 for an object outside of the image."""
        return self.pixels / np.maximum(self.pixels_alone, 1)


def measure_visibility(
    world: World, mount: CameraMount, label_image: Int16[np.ndarray, "h w"] | None = None
) -> Visibility:
    """Counts the pixels of every object in the scene, and alone. The world is as before afterwards.

    Args:
        world: with or without a robot, which may hide objects too.
        mount: the camera.
        label_image: its image of the world as it is now, by rays, if there is one already.
    """
    rays = _Rays(world, mount)
    windows = [_window(world, i, mount) for i in range(world.object_count)]
    present = [int(i) for i in np.flatnonzero(world.present)]
    seen = rays.labels(_around([windows[i] for i in present])) if label_image is None else label_image
    alone = np.zeros(world.object_count, dtype=np.int64)
    hidden_by = np.zeros((world.object_count, world.object_count), dtype=np.int64)
    state, positions, wxyz = save_state(world), world.positions, world.wxyz
    for i in present:
        world.park(i, Presence.DROPPED)
    for i in present:
        world.unpark(i, positions[i], wxyz[i])
        # Where an object shows in the scene it shows alone, too: no rays there.
        shows = seen == i
        hidden = rays.labels(windows[i], skip=shows) == i
        alone[i] = np.count_nonzero(shows) + np.count_nonzero(hidden)
        hidden_by[i] = _counts(seen[hidden], world.object_count)
        world.park(i, Presence.DROPPED)
    restore_state(world, state)
    return Visibility(_counts(seen, world.object_count), alone, hidden_by)


def _counts(labels: Int16[np.ndarray, "..."], objects: int) -> Int[np.ndarray, "n"]:
    """How many of the labels are each object's."""
    return np.bincount(labels[labels >= 0].astype(np.int64), minlength=objects)


class _Rays:
    """A ray for each pixel of a camera."""

    def __init__(self, world: World, mount: CameraMount) -> None:
        self._world, self._mount = world, mount
        directions = pixel_directions(mount.K, mount.width, mount.height)
        self._directions = directions.reshape(mount.height, mount.width, 3)

    def labels(
        self, window: _Window, skip: Bool[np.ndarray, "h w"] | None = None
    ) -> Int16[np.ndarray, "h w"]:
        """Object id per pixel within a window of the image; BACKGROUND outside and where rays are skipped."""
        world, mount = self._world, self._mount
        labels = np.full((mount.height, mount.width), BACKGROUND, np.int16)
        top, bottom, left, right = window
        wanted = np.zeros(labels.shape, dtype=bool)
        wanted[top:bottom, left:right] = True if skip is None else ~skip[top:bottom, left:right]
        if wanted.any():
            world.update_kinematics()
            _, geoms, _ = cast(
                world.model, world.data, mount.T_world_camera, self._directions[wanted], _FAR_M
            )
            # Geom -1 (nothing) reads the last entry.
            labels[wanted] = np.append(world.geom_labels, np.int16(BACKGROUND))[geoms]
        return labels


def _window(world: World, object_id: int, mount: CameraMount) -> _Window:
    """The part of the image in which an object can be: around its bounding box."""
    model = world.models[object_id]
    T = make_pose(rotation_from_wxyz(world.wxyz[object_id]), world.positions[object_id])
    corners = transform_points(invert(mount.T_world_camera) @ T, _corners(model))
    if corners[:, 2].min() < _NEAR_M:
        return 0, mount.height, 0, mount.width
    K = mount.K
    cols = K[0, 0] * corners[:, 0] / corners[:, 2] + K[0, 2]
    rows = K[1, 1] * corners[:, 1] / corners[:, 2] + K[1, 2]
    return (*_span(rows, mount.height), *_span(cols, mount.width))


def _span(values: Float[np.ndarray, "n"], size: int) -> tuple[int, int]:
    low = int(np.clip(np.floor(values.min()) - _MARGIN_PX, 0, size))
    high = int(np.clip(np.ceil(values.max()) + _MARGIN_PX + 1, 0, size))
    return low, high


def _corners(model: ObjectModel) -> Float[np.ndarray, "8 3"]:
    """Of the box around the surfaces to look at, model frame."""
    low = np.min([mesh.vertices.min(axis=0) for mesh in model.visuals], axis=0)
    high = np.max([mesh.vertices.max(axis=0) for mesh in model.visuals], axis=0)
    pick = np.array(np.meshgrid(*[(0, 1)] * 3)).reshape(3, -1).T
    return np.stack([low, high]).astype(float)[pick, np.arange(3)]


def _around(windows: list[_Window]) -> _Window:
    if not windows:
        return 0, 0, 0, 0
    tops, bottoms, lefts, rights = zip(*windows)
    return min(tops), max(bottoms), min(lefts), max(rights)
