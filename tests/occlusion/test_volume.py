"""Laws of the occlusion volume."""

from dataclasses import replace

import numpy as np
import pytest

from torc.geometry.transforms import project
from torc.occlusion.volume import (
    FIXED_REAL_CAMERA,
    OcclusionConfig,
    empty_volume,
    hidden_near_m3,
    hidden_volumes_m3,
    surface_labels,
    update_volume,
)
from torc.perception.noise import add_sensor_noise, stereo_camera
from torc.perception.segmentation import REAL_CAMERA
from torc.records import BACKGROUND, EMPTY, ROBOT, Capture, VoxelGrid
from torc.testing import contexts
from torc.testing.synthetic import (
    SyntheticBox,
    inside,
    random_clutter,
    synthetic_capture,
)
from torc.workspace.workspace_files import load_workspace

GRID = load_workspace().grid
SUPPORT_Z_M = load_workspace().support_z_m
BOX = SyntheticBox(1, (0.6, 0.0, SUPPORT_Z_M + 0.08), (0.08, 0.16, 0.16))


def perceive(shapes, **changes):
    seen = synthetic_capture(shapes)
    return contexts.see(replace(seen, observation=replace(seen.observation, **changes)))


def look(shapes, volume=None, config=None):
    return update_volume(empty_volume(GRID) if volume is None else volume, perceive(shapes), config)


def in_view(grid=GRID):
    mount = load_workspace().camera
    u, v, z = project(grid.centers().reshape(-1, 3), mount.K, mount.T_world_camera)
    ok = (z > 0) & (u > -0.5) & (v > -0.5) & (u < mount.width - 0.5) & (v < mount.height - 0.5)
    return ok.reshape(grid.shape)


def unknown(volume):
    return ~volume.seen


def has_bit(volume, object_id):
    return (volume.hidden_by & (np.uint64(1) << np.uint64(object_id))) != 0


def behind_box(box, points):
    """Independent: whether the segment from the eye to a point meets an axis-aligned box (slabs)."""
    eye = load_workspace().camera.T_world_camera[:3, 3]
    low, high = np.array(box.center) - np.array(box.size) / 2, np.array(box.center) + np.array(box.size) / 2
    with np.errstate(divide="ignore"):
        a, b = (low - eye) / (points - eye), (high - eye) / (points - eye)
    near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
    return (near < far) & (near < 1) & (far > 0)


def coarse_grid():
    return VoxelGrid(GRID.origin, 0.03, (20, 34, 14))


@pytest.mark.parametrize("seed", range(2))
def test_equals_the_definition_voxel_by_voxel(seed, reference_update):
    """Two snapshots with moved objects, robot pixels, holes and mad readings."""
    rng = np.random.default_rng(seed)
    shapes = list(random_clutter(rng, 12))
    config = OcclusionConfig(min_moved_points=4, hole_rad=0.0)
    fast = slow = empty_volume(coarse_grid())
    for snapshot in range(3):
        seen = synthetic_capture(shapes)
        depth, label = seen.observation.depth_m.copy(), seen.label_image.copy()
        for value in (0.0, np.nan, np.inf, 0.05, 50.0):
            r, c = rng.integers(120, 280), rng.integers(180, 400)
            depth[r : r + 25, c : c + 25] = value
        r, c = rng.integers(100, 300), rng.integers(150, 450)
        label[r : r + 60, c : c + 40] = ROBOT
        scene = contexts.see(Capture(replace(seen.observation, depth_m=depth), label))
        fast, slow = update_volume(fast, scene, config), reference_update(slow, scene, config)
        assert np.array_equal(fast.seen, slow.seen)
        assert np.array_equal(fast.hidden_by, slow.hidden_by)
        # Where two ids have equally many points the definition leaves open which one wins.
        assert np.mean(fast.surface_label != slow.surface_label) < 2e-3
        assert np.array_equal(fast.surface_label == EMPTY, slow.surface_label == EMPTY)
        assert fast.snapshots == snapshot + 1
        if snapshot == 0:
            shapes[3] = replace(shapes[3], center=(0.7, 0.3, shapes[3].center[2]))
            del shapes[0]


@pytest.mark.parametrize("flag", ["empty_pixels_are_free", "out_of_view_is_free"])
def test_the_options_equal_the_definition_too(flag, reference_update):
    depth = synthetic_capture([BOX]).observation.depth_m
    scene = perceive([BOX], depth_m=np.where(depth > 1.5, np.float32(0), depth))
    config = OcclusionConfig(**{flag: True}, hole_rad=0.0)
    fast = update_volume(empty_volume(coarse_grid()), scene, config)
    slow = reference_update(empty_volume(coarse_grid()), scene, config)
    plain = update_volume(empty_volume(coarse_grid()), scene)
    assert np.array_equal(fast.seen, slow.seen)
    assert np.array_equal(fast.hidden_by, slow.hidden_by)
    assert fast.seen.sum() > plain.seen.sum()


def test_unknown_never_grows_while_objects_are_only_taken_away(rng):
    shapes = list(random_clutter(rng, 14))
    volume = look(shapes)
    while shapes:
        shapes.pop(int(rng.integers(len(shapes))))
        after = look(shapes, volume)
        assert not np.any(unknown(after) & volume.seen)
        volume = after
    assert np.all(volume.seen[in_view()])


def test_the_shadow_of_a_box_has_its_analytic_volume():
    volume = look([BOX])
    points = np.random.default_rng(0).uniform(GRID.origin, GRID.upper, (1_000_000, 3))
    share = np.mean(behind_box(BOX, points))
    truth_m3 = share * np.prod(GRID.upper - GRID.origin)
    assert volume.hidden_volume_m3(1) == pytest.approx(truth_m3, rel=0.05)
    # And it is in the right place.
    shadow = behind_box(BOX, GRID.centers()) & in_view()
    assert np.mean(has_bit(volume, 1)[shadow]) > 0.95
    assert np.mean(shadow[has_bit(volume, 1)]) > 0.98
    assert np.array_equal(unknown(volume) & in_view(), has_bit(volume, 1))


def test_an_object_that_moved_into_seen_space_is_unknown_inside():
    before = look([BOX])
    moved = replace(BOX, center=(0.6, -0.3, BOX.center[2]))
    after = look([moved], before)
    deep = inside(moved, GRID.centers(), -0.01)
    assert np.all(before.seen[deep & in_view()])
    assert np.all(has_bit(after, 1)[deep])
    # Farther behind it than an object reaches, what was seen stays seen; its old place is free.
    eye = load_workspace().camera.T_world_camera[:3, 3]
    far = np.linalg.norm(GRID.centers() - eye, axis=-1) > np.linalg.norm(np.array(moved.center) - eye) + 0.25
    assert not np.any(unknown(after)[far & before.seen])
    assert np.all(after.seen[inside(BOX, GRID.centers()) & in_view()])


@pytest.mark.usefixtures("any_arrays")
def test_most_points_win_a_voxel_and_objects_win_over_the_background():
    scene = perceive([BOX])
    o = scene.objects[0]
    corner = GRID.origin + 0.1
    clouds = {3: 5, 4: 9, 6: 3}
    rng = np.random.default_rng(0)
    objects = tuple(
        replace(o, id=i, points=(corner + rng.uniform(0.001, 0.009, (n, 3))).astype(np.float32))
        for i, n in clouds.items()
    )
    table = np.array([[0.6, 0.0, GRID.origin[2] + 0.011], [0.6, 0.0, GRID.origin[2] + 0.025]])
    points = np.concatenate([corner + rng.uniform(0.001, 0.009, (50, 3)), table]).astype(np.float32)
    label = surface_labels(GRID, replace(scene, objects=objects, background_points=points))
    assert label[10, 10, 10] == 4
    assert label[tuple(GRID.index_of(table[0]))] == EMPTY
    assert label[tuple(GRID.index_of(table[1]))] == BACKGROUND
    assert np.count_nonzero(label != EMPTY) == 2


def test_smoothing_takes_away_what_single_bad_readings_hide_and_keeps_the_shadows(rng):
    clean = synthetic_capture([BOX])
    noisy = add_sensor_noise(clean, stereo_camera(), rng)
    truth = update_volume(empty_volume(GRID), contexts.see(clean))
    raw = update_volume(empty_volume(GRID), contexts.see(noisy), OcclusionConfig(hole_rad=0.0))
    scene = contexts.see(noisy, REAL_CAMERA)
    smooth = update_volume(empty_volume(GRID), scene, OcclusionConfig(smooth_px=FIXED_REAL_CAMERA.smooth_px))
    extra_raw = np.count_nonzero(unknown(raw) & truth.seen)
    extra = np.count_nonzero(unknown(smooth) & truth.seen)
    assert extra < 0.25 * extra_raw
    lost = np.count_nonzero(smooth.seen & unknown(truth))
    assert lost < 0.05 * np.count_nonzero(unknown(truth))
    # What is hidden beside an eroded mask is hidden by the object, not by the room.
    dark = unknown(smooth) & in_view() & has_bit(truth, 1)
    assert np.mean(has_bit(smooth, 1)[dark]) > 0.99


def test_hidden_volumes_are_the_records_own(rng: np.random.Generator) -> None:
    volume = contexts.hidden_context().volume
    masks = rng.integers(0, 2**64, volume.hidden_by.shape, dtype=np.uint64) & rng.integers(
        0, 2**64, volume.hidden_by.shape, dtype=np.uint64
    )
    volume = replace(volume, hidden_by=masks)
    expected = [volume.hidden_volume_m3(k) for k in range(64)]
    np.testing.assert_allclose(hidden_volumes_m3(volume, range(64)), expected, rtol=1e-12)


def test_space_near_points_is_that_of_the_voxels_in_the_box_around_them(rng: np.random.Generator) -> None:
    volume = contexts.hidden_context().volume
    masks = rng.integers(0, 8, volume.hidden_by.shape, dtype=np.uint64)
    volume = replace(volume, hidden_by=masks)
    grid, centers = volume.grid, volume.grid.centers()
    middle, size = 0.5 * (grid.origin + grid.upper), grid.upper - grid.origin
    for center in (middle, grid.origin, grid.upper, grid.upper + 2.0, grid.origin - 2.0):
        points = center + 0.1 * size * rng.uniform(-1, 1, (5, 3))
        low, high = points.min(axis=0) - 0.05, points.max(axis=0) + 0.05
        reached = np.all(
            (centers > low - grid.voxel_size_m / 2) & (centers < high + grid.voxel_size_m / 2), axis=-1
        )
        expected = [
            np.count_nonzero(reached & (masks & np.uint64(1 << k) > 0)) * grid.voxel_size_m**3
            for k in range(3)
        ]
        np.testing.assert_allclose(
            hidden_near_m3(volume, range(3), points, 0.05), expected, rtol=1e-9, atol=1e-15
        )
