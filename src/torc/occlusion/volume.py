"""The occlusion volume, updated snapshot by snapshot (paper: Perception).

A voxel is unknown until a snapshot sees it free or on a surface; then it stays seen, unless an object has moved
there. An unknown voxel carries the bit of the object whose pixel hides it. Of a stereo pair, both cameras count.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, Int32, UInt8, UInt64
from numba import njit

from torc.errors import InputError
from torc.geometry.transforms import finer, invert, kernel_array
from torc.occlusion.holes import bridge_holes
from torc.occlusion.projection_kernels import (
    FREE,
    NO_READING,
    OUT_OF_VIEW,
    hold_bridged,
    points_in_free_space,
    project_voxels,
    vote_labels,
)
from torc.parallel import each
from torc.perception.image_kernels import looked_up
from torc.records import BACKGROUND, EMPTY, MAX_OBJECTS, OcclusionVolume, SegmentedScene, VoxelGrid


@dataclass(frozen=True)
class OcclusionConfig:
    """How snapshots change the volume.

    Attributes:
        min_depth_m: smaller readings, and those that are not finite, do not count.
        max_depth_m: a larger reading means free space as far as this.
        support_margin_m: background points this close to the grid's floor are the support surface: not stored.
        object_depth_m: how far behind its visible surface an object that moved may reach, along the ray.
        min_moved_points: fewer points than this in formerly free space are noise.
        moved_share: an object with this share of its points in formerly free space has moved as a whole.
        empty_pixels_are_free: treat background pixels without a reading as free space, for sources that give no reading
            if nothing is in range. Off, what lies behind these pixels stays unknown.
        out_of_view_is_free: treat what the camera can never see as free instead of unknown. For a fixed camera whose
            image does not cover the grid: it would stay unknown for ever.
        smooth_px: width of a median filter of the depth, 0 (none), 3 or 5, and 5 for large pictures: single lost or
            smeared readings would leave unknown voxels all along their rays, and block the arm. Surfaces are not
            smoothed. Background pixels this close to an object hide space as part of it.
        hole_rad: holes in the depth up to this wide, as an angle of view, are bridged from the readings around them,
            see `bridge_holes`; the surroundings hide what is hidden there. .035 is 2.5 cm at a distance of 70 cm. 0
            leaves them open: all of their rays stay unknown.
    """

    min_depth_m: float = 0.1
    max_depth_m: float = 3.0
    support_margin_m: float = 0.012
    object_depth_m: float = 0.12
    min_moved_points: int = 12
    moved_share: float = 0.2
    empty_pixels_are_free: bool = False
    out_of_view_is_free: bool = False
    smooth_px: int = 0
    hole_rad: float = 0.035

    def __post_init__(self) -> None:
        if not 0 <= self.hole_rad < 0.5:
            raise InputError(f"OcclusionConfig.hole_rad is {self.hole_rad}; it must be from 0 to .5.")
        if self.smooth_px not in (0, 3, 5):
            raise InputError(f"OcclusionConfig.smooth_px is {self.smooth_px}; it must be 0, 3 or 5.")


FIXED_CAMERA = OcclusionConfig(out_of_view_is_free=True)
"""For a camera that never moves: what it can never see counts as outside the volume, since as unknown space it would
block the arm for ever.
"""

FIXED_REAL_CAMERA = replace(FIXED_CAMERA, smooth_px=3)
"""`FIXED_CAMERA` for a sensor with lost and smeared readings: lost ones are bridged, and smeared ones filtered."""


_NOWHERE = np.iinfo(np.int64).max


def empty_volume(grid: VoxelGrid) -> OcclusionVolume:
    """Return the volume before any snapshot: everything unknown, hidden by nothing."""
    if min(grid.shape) < 1 or grid.voxel_size_m <= 0:
        raise InputError(
            f"A grid of shape {grid.shape} with voxels of {grid.voxel_size_m} m holds no volume."
        )
    return OcclusionVolume(
        grid=grid,
        seen=np.zeros(grid.shape, dtype=bool),
        hidden_by=np.zeros(grid.shape, dtype=np.uint64),
        surface_label=np.full(grid.shape, EMPTY, dtype=np.int16),
        snapshots=0,
    )


def update_volume(
    volume: OcclusionVolume, scene: SegmentedScene, config: OcclusionConfig | None = None
) -> OcclusionVolume:
    """Return the volume after one more snapshot; the input is unchanged.

    Robot and background pixels hide voxels without a bit, and so do objects too small to be reported. Surface labels
    are those of this snapshot alone.
    """
    config = OcclusionConfig() if config is None else config
    grid = volume.grid
    surface = surface_labels(grid, scene, config)
    readings = _readings(scene, config)
    views: list[Callable[..., Any]] = [_left_view, _right_view]
    left, right = each(lambda view: view(volume, scene, readings, config), views)
    state, bits, near_behind = left
    seen_now = (state == FREE) | (surface != EMPTY)
    if right is not None:
        free, hidden_by = right
        seen_now |= free
        bits = np.where((state == NO_READING) & (bits == 0), hidden_by, bits)
    if config.out_of_view_is_free:
        seen_now |= state == OUT_OF_VIEW
    seen = seen_now | (volume.seen & ~near_behind)
    bits[seen] = 0
    return OcclusionVolume(grid, seen, bits, surface, volume.snapshots + 1)


def surface_labels(
    grid: VoxelGrid, scene: SegmentedScene, config: OcclusionConfig | None = None
) -> Int16[np.ndarray, "nx ny nz"]:
    """Return, per voxel, the id of most of its surface points; objects win over the background; EMPTY elsewhere."""
    config = OcclusionConfig() if config is None else config
    origin, voxel_m = _place(grid)
    label = np.full(grid.shape, EMPTY, dtype=np.int16)
    votes = np.zeros(grid.shape, dtype=np.int32)
    for o in scene.objects:
        vote_labels(kernel_array(o.points, np.float32), o.id, origin, voxel_m, label, votes)
    above = scene.background_points[:, 2] > origin[2] + config.support_margin_m
    background = np.full(grid.shape, EMPTY, dtype=np.int16)
    points = kernel_array(scene.background_points[above], np.float32)
    vote_labels(points, BACKGROUND, origin, voxel_m, background, np.zeros_like(votes))
    return np.where(label == EMPTY, background, label)


def _place(grid: VoxelGrid) -> tuple[np.ndarray, float]:
    return kernel_array(grid.origin), float(grid.voxel_size_m)


def _left_view(
    volume: OcclusionVolume,
    scene: SegmentedScene,
    readings: Float32[np.ndarray, "h w"],
    config: OcclusionConfig,
) -> tuple[UInt8[np.ndarray, "nx ny nz"], UInt64[np.ndarray, "nx ny nz"], Bool[np.ndarray, "nx ny nz"]]:
    """Return how the camera sees each voxel, see `project_voxels`; `readings` are its depth."""
    view, (origin, voxel_m) = scene.observation, _place(volume.grid)
    rays, bridged = _rays(volume, scene, readings, config)
    K, T_camera_world = kernel_array(view.K), kernel_array(invert(view.T_world_camera))
    seen = project_voxels(volume.grid.shape, origin, voxel_m, T_camera_world, K, *rays, config.object_depth_m)
    hold_bridged(bridged, *rays, K, kernel_array(view.T_world_camera), origin, voxel_m, *seen)
    return seen


def _rays(
    volume: OcclusionVolume,
    scene: SegmentedScene,
    readings: Float32[np.ndarray, "h w"],
    config: OcclusionConfig,
) -> tuple[
    tuple[Float32[np.ndarray, "h w"], UInt64[np.ndarray, "h w"], Bool[np.ndarray, "h w"]],
    Int32[np.ndarray, "n 2"],
]:
    """Return what a snapshot shows along each pixel's ray.

    That is how far space is free, 0 if that is not known; the bits of the object that hides what lies behind, see
    `_bits_by_label`; whether the pixel shows an object where free space was seen before; row and column of the pixels
    that show an object only by the readings around them.
    """
    readings, label = np.minimum(readings, np.float32(config.max_depth_m)), _labels(scene, config)
    K = scene.observation.K
    depth_m, source = bridge_holes(readings, label, float(min(K[0, 0], K[1, 1])), config.hole_rad)
    label = looked_up(label.ravel(), source)
    bridged = np.argwhere((readings == 0) & (depth_m > 0) & (label >= 0))
    if config.empty_pixels_are_free:
        depth_m[(depth_m == 0) & (label == BACKGROUND)] = config.max_depth_m
    if config.smooth_px:
        depth_m = cv2.medianBlur(depth_m, _smooth_px(scene, config))
    rays = (
        kernel_array(depth_m, np.float32),
        looked_up(_bits_by_label(scene), label),
        looked_up(_disturbed_pixels(volume, scene, config).ravel(), source),
    )
    return rays, kernel_array(bridged, np.int32)


def _readings(scene: SegmentedScene, config: OcclusionConfig) -> Float32[np.ndarray, "h w"]:
    """Return depth; 0 where there is no reading."""
    depth_m = scene.observation.depth_m
    with np.errstate(invalid="ignore"):
        good = (depth_m >= config.min_depth_m) & (depth_m < np.inf)
    return kernel_array(np.where(good, depth_m, np.float32(0)), np.float32)


def _labels(scene: SegmentedScene, config: OcclusionConfig) -> Int16[np.ndarray, "h w"]:
    """Return the label image; if depth is smoothed, objects have spread into the background."""
    label = kernel_array(scene.label_image, np.int16)
    if config.smooth_px == 0:
        return label
    width = _smooth_px(scene, config)
    spread = cv2.dilate(label, np.ones((width, width), dtype=np.uint8))
    return kernel_array(np.where(label == BACKGROUND, spread, label), np.int16)


def _smooth_px(scene: SegmentedScene, config: OcclusionConfig) -> int:
    """Return the filter's width, which is odd and at most 5."""
    s = finer(scene.label_image.shape)
    return min(2 * round(s * config.smooth_px / 2 - 0.5) + 1, 5)


def _bits_by_label(scene: SegmentedScene) -> UInt64[np.ndarray, "n"]:
    """Return the bit of each object, by label; 0 for objects not reported and, from the end, background and robot."""
    bits = np.zeros(MAX_OBJECTS + 2, dtype=np.uint64)
    for i in scene.ids:
        bits[i] = np.uint64(1) << np.uint64(i)
    return bits


def _disturbed_pixels(
    volume: OcclusionVolume, scene: SegmentedScene, config: OcclusionConfig
) -> Bool[np.ndarray, "h w"]:
    """Return pixels that show an object where free space was seen before: something moved there.

    They are all of the object's pixels if a large share lies there.
    """
    disturbed = np.zeros(scene.label_image.shape, dtype=bool)
    if volume.snapshots == 0:
        return disturbed
    origin, voxel_m = _place(volume.grid)
    seen, surface = kernel_array(volume.seen, np.bool_), kernel_array(volume.surface_label, np.int16)
    for o in scene.objects:
        moved = points_in_free_space(kernel_array(o.points, np.float32), origin, voxel_m, seen, surface)
        count = np.count_nonzero(moved)
        if count >= config.min_moved_points:
            pixels = o.pixels if count >= config.moved_share * len(moved) else o.pixels[moved]
            disturbed[pixels[:, 0], pixels[:, 1]] = True
    return disturbed


def _right_view(
    volume: OcclusionVolume,
    scene: SegmentedScene,
    readings: Float32[np.ndarray, "h w"],
    config: OcclusionConfig,
) -> tuple[Bool[np.ndarray, "nx ny nz"], UInt64[np.ndarray, "nx ny nz"]] | None:
    """Return which voxels the right camera of a view's pair saw through, and the bits of what hides others from it.

    A reading is a point that both cameras saw, so nothing lies between it and either of them. That matters most beside
    near objects: there is a strip that only the left camera sees. It has no reading, and all of its rays would count as
    unseen. The right camera looks through most of that space; what lies behind is hidden from it by the near object.

    `readings` are the left camera's depth, made from the pair.
    """
    view, (origin, voxel_m) = scene.observation, _place(volume.grid)
    if view.pair is None:
        return None
    K, T_right_world = kernel_array(view.K), kernel_array(invert(view.T_world_camera))
    T_right_world[0, 3] -= view.pair.baseline_m
    depth_m, source = _to_right(readings, float(K[0, 0]) * view.pair.baseline_m)
    depth_m = np.minimum(depth_m, np.float32(config.max_depth_m))
    label = looked_up(np.append(scene.label_image.ravel(), np.int16(BACKGROUND)), source)
    rays = depth_m, looked_up(_bits_by_label(scene), label), np.zeros(depth_m.shape, np.bool_)
    state, hidden_by, _ = project_voxels(volume.grid.shape, origin, voxel_m, T_right_world, K, *rays, 0.0)
    return state == FREE, hidden_by


@njit(cache=True, nogil=True)
def _to_right(
    depth: Float32[np.ndarray, "h w"], focal_times_baseline: float
) -> tuple[Float32[np.ndarray, "h w"], Int32[np.ndarray, "h w"]]:
    """Return the nearest reading within a pixel of each right pixel (0: none), and the left pixel it is of (-1: none).

    Within a pixel: near things become a little wider, and what lies behind them never shows through.
    """
    height, width = depth.shape
    # The bits of a depth, which sort as it does, above those of its source: one minimum finds both.
    bits = depth.view(np.int32)
    nearest = np.full((height + 2, width + 2), _NOWHERE)
    for row in range(height):
        for col in range(width):
            d = depth[row, col]
            if d == 0:
                continue
            shown = int(np.floor(col - focal_times_baseline / d + 0.5)) + 1
            if 0 <= shown < width + 2:
                key = np.int64(bits[row, col]) << 32 | (row * width + col)
                nearest[row + 1, shown] = min(nearest[row + 1, shown], key)
    for row in range(height + 2):
        for col in range(width):
            nearest[row, col] = min(nearest[row, col], nearest[row, col + 1], nearest[row, col + 2])
    right = np.zeros((height, width), np.float32)
    source = np.full((height, width), -1, np.int32)
    for row in range(height):
        for col in range(width):
            key = min(nearest[row, col], nearest[row + 1, col], nearest[row + 2, col])
            if key != _NOWHERE:
                source[row, col] = key & 0x7FFFFFFF
                right.view(np.int32)[row, col] = key >> 32
    return right, source


def hidden_volumes_m3(volume: OcclusionVolume, ids: Iterable[int]) -> Float[np.ndarray, "n"]:
    """Return OcclusionVolume.hidden_volume_m3 of many objects in one pass."""
    return _hidden_m3(volume.hidden_by, ids, volume.grid.voxel_size_m)


def hidden_near_m3(
    volume: OcclusionVolume, ids: Iterable[int], points: Float[np.ndarray, "n 3"], reach_m: float
) -> Float[np.ndarray, "k"]:
    """Return the volume hidden in the box around some points (world frame), enlarged by `reach_m` on all sides."""
    low = np.maximum(volume.grid.index_of(points.min(axis=0) - reach_m), 0)
    high = np.maximum(volume.grid.index_of(points.max(axis=0) + reach_m) + 1, 0)
    box = tuple(slice(a, b) for a, b in zip(low.tolist(), high.tolist()))
    return _hidden_m3(volume.hidden_by[box], ids, volume.grid.voxel_size_m)


def _hidden_m3(masks: UInt64[np.ndarray, "nx ny nz"], ids: Iterable[int], voxel_size_m: float) -> np.ndarray:
    hidden = masks[masks != 0]
    counts = [np.count_nonzero(hidden & (np.uint64(1) << np.uint64(k))) for k in ids]
    return np.array(counts, dtype=np.int64) * voxel_size_m**3
