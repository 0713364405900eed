"""The right camera of a stereo pair: it clears what it sees through, and nothing that it does not."""

from dataclasses import replace

import numpy as np
import pytest

from torc.geometry.transforms import project
from torc.occlusion.volume import FIXED_CAMERA, empty_volume, update_volume
from torc.records import StereoPair
from torc.testing.contexts import see
from torc.testing.synthetic import SyntheticBox, inside, random_clutter, raycast, synthetic_capture
from torc.workspace.workspace_files import load_workspace

WORKSPACE = load_workspace()
GRID, LEFT = WORKSPACE.grid, WORKSPACE.camera
BASELINE_M = 0.095
RIGHT = replace(LEFT, T_world_camera=LEFT.T_world_camera @ np.array(
    [[1, 0, 0, BASELINE_M], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]
))  # fmt: skip
POST = SyntheticBox(1, (0.6, 0.0, WORKSPACE.support_z_m + 0.15), (0.06, 0.10, 0.30))


def stereo_view(shapes):
    """What the left camera sees, with readings only where the right one sees the same point; by rays, not matched."""
    capture, right = synthetic_capture(shapes, LEFT), raycast(shapes, RIGHT)
    view = capture.observation
    rows, cols = np.indices(view.depth_m.shape)
    z = view.depth_m
    shown = np.rint(cols - view.K[0, 0] * BASELINE_M / z).astype(int)
    inside_right = shown >= 0
    there = right.depth_m[rows, np.maximum(shown, 0)]
    both = inside_right & (np.abs(there - z) < 0.03 * z)
    pair = StereoPair(np.zeros(z.shape, np.uint8), np.zeros(z.shape, np.uint8), BASELINE_M)
    return replace(capture, observation=replace(view, depth_m=np.where(both, z, np.float32(0)), pair=pair))


def volumes(shapes, config=FIXED_CAMERA):
    """With the left camera alone, and with both."""
    scene = see(stereo_view(shapes))
    alone = replace(scene, observation=replace(scene.observation, pair=None))
    return [update_volume(empty_volume(GRID), s, config) for s in (alone, scene)]


def pixels_of_right(points):
    u, v, z = project(points, RIGHT.K, RIGHT.T_world_camera)
    return np.rint(v).astype(int), np.rint(u).astype(int), z


def seen_near(depth_m, points):
    """How far the right camera sees around each point, by rays: the furthest within two pixels."""
    row, col, _ = pixels_of_right(points)
    h, w = depth_m.shape
    around = [
        depth_m[np.clip(row + r, 0, h - 1), np.clip(col + c, 0, w - 1)]
        for r in range(-2, 3)
        for c in range(-2, 3)
    ]
    return np.max(around, axis=0)


@pytest.mark.parametrize("seed", range(3))
def test_it_clears_only_what_the_right_camera_sees_through_and_nothing_within_a_thing(seed):
    shapes = random_clutter(np.random.default_rng(seed), 10)
    alone, both = volumes(shapes)
    cleared = GRID.centers()[both.seen & ~alone.seen]
    assert len(cleared) > 1000
    _, _, z = pixels_of_right(cleared)
    assert np.all(z < seen_near(raycast(shapes, RIGHT).depth_m, cleared) + 1e-3)
    assert not any(inside(shape, cleared, -GRID.voxel_size_m).any() for shape in shapes)
    assert np.all(both.seen | ~alone.seen), "what was seen stays seen"


def test_a_shorter_range_changes_nothing_within_it():
    """The right camera sees what is out of range where it is, not where the range ends."""
    range_m = 0.7
    whole, short = (volumes([POST], replace(FIXED_CAMERA, max_depth_m=m))[1] for m in (10.0, range_m))
    near = (
        project(GRID.centers().reshape(-1, 3), LEFT.K, LEFT.T_world_camera)[2].reshape(GRID.shape) < range_m
    )
    assert np.array_equal(whole.seen & near, short.seen & near)


def test_beside_a_post_the_space_before_it_is_seen_and_that_behind_it_is_hidden_by_it():
    alone, both = volumes([POST])
    x, y, z = np.moveaxis(GRID.centers(), -1, 0)
    unread = unread_beside_it(stereo_view([POST])) & (np.abs(y) < 0.2)
    before = unread & (x < 0.54) & (z > WORKSPACE.support_z_m + 0.02)
    behind = unread & (x > 0.70)
    assert before.sum() > 100
    assert behind.sum() > 100
    assert np.mean(alone.seen[before]) < 0.5
    assert np.mean(both.seen[before]) > 0.95
    bit = np.uint64(1 << POST.id)
    hidden = behind & ~both.seen
    assert not np.any(alone.hidden_by[hidden] & bit)
    assert np.mean((both.hidden_by[hidden] & bit) != 0) > 0.9


def unread_beside_it(capture):
    """Voxels on rays of background pixels that have no reading."""
    view = capture.observation
    u, v, _ = project(GRID.centers().reshape(-1, 3), view.K, view.T_world_camera)
    row, col = (
        np.clip(np.rint(at), 0, n - 1).astype(int) for at, n in zip((v, u), view.depth_m.shape, strict=True)
    )
    return ((view.depth_m == 0) & (capture.label_image != POST.id))[row, col].reshape(GRID.shape)
