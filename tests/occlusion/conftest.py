"""The occlusion volume by its definition: one voxel at a time, no shared code with the fast path. Slow."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from torc.occlusion.volume import OcclusionConfig
from torc.records import BACKGROUND, EMPTY, OcclusionVolume, SegmentedScene


@pytest.fixture
def reference_update() -> Callable[..., OcclusionVolume]:
    """What `update_volume` should return, by definition."""
    return _update


def _update(volume: OcclusionVolume, scene: SegmentedScene, config: OcclusionConfig) -> OcclusionVolume:
    grid, view = volume.grid, scene.observation
    surface = _surface(grid, scene, config)
    moved = _moved_pixels(volume, scene, config)
    seen = np.zeros(grid.shape, dtype=bool)
    bits = np.zeros(grid.shape, dtype=np.uint64)
    T_camera_world = np.linalg.inv(view.T_world_camera)
    height, width = view.depth_m.shape
    for index in np.ndindex(grid.shape):
        center = grid.origin + (np.array(index) + 0.5) * grid.voxel_size_m
        p = T_camera_world[:3, :3] @ center + T_camera_world[:3, 3]
        u, v, _ = view.K @ p / p[2]
        col, row = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
        in_view = p[2] > 0 and 0 <= col < width and 0 <= row < height
        known, bit = bool(volume.seen[index]), 0
        if not in_view:
            known |= config.out_of_view_is_free
        else:
            label, d = int(scene.label_image[row, col]), float(view.depth_m[row, col])
            readable = np.isfinite(d) and d >= config.min_depth_m
            own_bit = 1 << label if label in scene.ids else 0
            if not readable:
                known |= config.empty_pixels_are_free and label == BACKGROUND
                bit = own_bit
            elif p[2] < min(d, config.max_depth_m):
                known = True
            else:
                surface_point = p * d / p[2]
                if (row, col) in moved and np.linalg.norm(p - surface_point) <= config.object_depth_m:
                    known = False
                bit = own_bit
        known |= surface[index] != EMPTY
        seen[index] = known
        bits[index] = 0 if known else bit
    return OcclusionVolume(grid, seen, bits, surface, volume.snapshots + 1)


def _voxel(grid, point):
    index = tuple(int(np.floor(x)) for x in (point.astype(float) - grid.origin) / grid.voxel_size_m)
    return index if all(0 <= i < n for i, n in zip(index, grid.shape)) else None


def _surface(grid, scene, config):
    votes: dict[tuple, Counter] = {}
    for o in scene.objects:
        for point in o.points:
            index = _voxel(grid, point)
            if index is not None:
                votes.setdefault(index, Counter())[o.id] += 1
    label = np.full(grid.shape, EMPTY, dtype=np.int16)
    for point in scene.background_points:
        index = _voxel(grid, point)
        if index is not None and point[2] > grid.origin[2] + config.support_margin_m:
            label[index] = BACKGROUND
    for index, counter in votes.items():
        label[index] = counter.most_common(1)[0][0]
    return label


def _moved_pixels(volume, scene, config):
    grid, out = volume.grid, set()
    if volume.snapshots == 0:
        return out
    for o in scene.objects:
        moved = []
        for point, pixel in zip(o.points, o.pixels):
            index = _voxel(grid, point)
            if index is None:
                continue
            around = tuple(slice(max(i - 1, 0), i + 2) for i in index)
            if np.all(volume.seen[around]) and np.all(volume.surface_label[around] == EMPTY):
                moved.append(tuple(int(x) for x in pixel))
        if len(moved) >= config.min_moved_points:
            whole = len(moved) >= config.moved_share * len(o.points)
            out |= {tuple(int(x) for x in pixel) for pixel in o.pixels} if whole else set(moved)
    return out
