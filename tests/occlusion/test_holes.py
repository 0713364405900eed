"""Laws of bridged holes: readings are not touched, and nothing is called free that may not be."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion, distance_transform_edt

from torc.geometry.transforms import project
from torc.occlusion.holes import bridge_holes
from torc.occlusion.volume import OcclusionConfig, empty_volume, update_volume
from torc.records import BACKGROUND, EMPTY, Capture
from torc.testing.contexts import see
from torc.testing.synthetic import SyntheticBox, inside, random_clutter, synthetic_capture
from torc.workspace.workspace_files import load_workspace

GRID = load_workspace().grid
SUPPORT_Z_M = load_workspace().support_z_m
OPEN = OcclusionConfig(hole_rad=0.0)
BOX = SyntheticBox(1, (0.6, 0.0, SUPPORT_Z_M + 0.08), (0.08, 0.16, 0.16))
FOCAL_PX = float(load_workspace().camera.K[0, 0])
HOLE_RAD = OcclusionConfig().hole_rad


def volume_of(view, lost=None, config=None, before=None):
    observation = view.observation
    if lost is not None:
        observation = replace(observation, depth_m=np.where(lost, np.float32(0), observation.depth_m))
    scene = see(replace(view, observation=observation))
    return update_volume(empty_volume(GRID) if before is None else before, scene, config)


def free(volume):
    return volume.seen & (volume.surface_label == EMPTY)


def pixels_of_voxels():
    """Row and column that each voxel's centre projects to."""
    mount = load_workspace().camera
    u, v, _ = project(GRID.centers().reshape(-1, 3), mount.K, mount.T_world_camera)
    row, col = np.round(v).astype(int).clip(0, 479), np.round(u).astype(int).clip(0, 639)
    return row.reshape(GRID.shape), col.reshape(GRID.shape)


def speckles(rng, share=0.05):
    return rng.random((480, 640)) < share


def discs(rng, count=400):
    mask = np.zeros((480, 640), np.uint8)
    for _ in range(count):
        row, col = rng.integers(480), rng.integers(640)
        cv2.circle(mask, (int(col), int(row)), int(rng.integers(1, 4)), 1, thickness=-1)
    return mask.astype(bool)


def edges(depth_m, px):
    """Pixels within px of a jump in depth, by their definition."""
    far = cv2.dilate(depth_m, np.ones((3, 3), np.uint8))
    near = cv2.erode(depth_m, np.ones((3, 3), np.uint8))
    jump = far - near > 0.05 * depth_m
    return binary_dilation(jump, np.ones((3, 3)), iterations=px - 1) if px > 1 else jump


@pytest.mark.parametrize("seed", range(2))
def test_without_holes_nothing_changes(seed):
    view = synthetic_capture(random_clutter(np.random.default_rng(seed), 15))
    assert np.all(view.observation.depth_m > 0)
    depth, source = bridge_holes(view.observation.depth_m, view.label_image, FOCAL_PX, HOLE_RAD)
    assert np.array_equal(depth, view.observation.depth_m)
    assert np.array_equal(source.ravel(), np.arange(depth.size))
    bridged, left_open = volume_of(view), volume_of(view, config=OPEN)
    assert np.array_equal(bridged.seen, left_open.seen)
    assert np.array_equal(bridged.hidden_by, left_open.hidden_by)
    assert np.array_equal(bridged.surface_label, left_open.surface_label)


def test_readings_are_never_touched(rng):
    view = synthetic_capture(random_clutter(rng, 15))
    lost = speckles(rng, 0.2) | discs(rng)
    holed = np.where(lost, np.float32(0), view.observation.depth_m)
    depth, source = bridge_holes(holed, view.label_image, FOCAL_PX, HOLE_RAD)
    assert np.array_equal(depth[~lost], view.observation.depth_m[~lost])
    assert np.array_equal(source[~lost], np.flatnonzero(~lost))
    assert np.all(holed.ravel()[source[lost & (depth > 0)]] > 0)


@pytest.mark.parametrize("tilt", [0.0, 1.0, 2.0])
def test_small_holes_in_a_plane_get_its_depth(tilt, rng):
    row, col = np.mgrid[:480, :640]
    plane = (1.0 / (1.2 + tilt * (row - 240) / FOCAL_PX * 0.4 + 0.3 * (col - 320) / FOCAL_PX)).astype(
        np.float32
    )
    lost = speckles(rng, 0.05) | discs(rng, 300)
    depth, _ = bridge_holes(
        np.where(lost, np.float32(0), plane), np.full(plane.shape, BACKGROUND, np.int16), FOCAL_PX, HOLE_RAD
    )
    inner = lost & (depth > 0)
    assert np.mean(inner[lost]) > 0.99
    assert np.quantile(np.abs(depth / plane - 1)[inner], 0.99) < 1e-4
    # Where no slope is known the nearer of two readings counts: never more than the plane.
    assert np.max((depth / plane - 1)[inner]) < 1e-4


@pytest.mark.parametrize("place", [(slice(210, 260), slice(240, 300)), (slice(300, 330), slice(100, 600))])
def test_a_large_hole_stays_unknown_and_nobody_hides_it(place):
    view = synthetic_capture([])
    lost = np.zeros(view.observation.depth_m.shape, bool)
    lost[place] = True
    depth, _ = bridge_holes(
        np.where(lost, np.float32(0), view.observation.depth_m), view.label_image, FOCAL_PX, HOLE_RAD
    )
    # No more than its corners are bridged.
    widest = HOLE_RAD * FOCAL_PX
    deep = distance_transform_edt(lost) > 0.5 * widest
    assert deep.any()
    assert not np.any(depth[deep])
    assert np.count_nonzero(lost & (depth > 0)) <= 4 * 0.5 * widest**2
    volume = volume_of(view, lost)
    hole = deep[pixels_of_voxels()]
    assert hole.any()
    assert not np.any(volume.seen[hole])
    assert not np.any(volume.hidden_by[hole])


@pytest.mark.parametrize("masks", [True, False])
@pytest.mark.parametrize("px", [1, 2])
@pytest.mark.parametrize("seed", range(2))
def test_unread_edges_call_nothing_free_that_is_not(seed, px, masks):
    """By brute force against the complete frame. A voxel's width is left for where surfaces are rounded to voxels."""
    view = synthetic_capture(random_clutter(np.random.default_rng(seed), 12))
    if not masks:
        view = Capture(view.observation, np.full_like(view.label_image, BACKGROUND))
    full, holed = volume_of(view), volume_of(view, edges(view.observation.depth_m, px))
    wrong = free(holed) & ~free(full)
    assert not np.any(wrong & binary_erosion(~free(full), np.ones((3, 3, 3)), border_value=1))
    assert np.count_nonzero(wrong) < 0.05 * np.count_nonzero(full.surface_label != EMPTY)
    # And it is worth something, most where masks tell on which side of an edge a pixel is.
    left_open = volume_of(view, edges(view.observation.depth_m, px), OPEN)
    wasted = np.count_nonzero(free(full) & ~free(holed)) / np.count_nonzero(free(full) & ~free(left_open))
    assert wasted < (0.05 if masks else 0.5)


def test_a_hole_in_an_object_is_hidden_by_it():
    # Its face is not where two voxels meet.
    view = synthetic_capture([replace(BOX, center=(0.604, 0.0, BOX.center[2]))])
    rows, cols = np.nonzero(view.label_image == 1)
    row, col = int(rows.mean()), int(cols.mean())
    lost = np.zeros(view.observation.depth_m.shape, bool)
    lost[row - 5 : row + 6, col - 5 : col + 6] = True
    full, holed, left_open = volume_of(view), volume_of(view, lost), volume_of(view, lost, OPEN)
    assert np.count_nonzero(free(full) & ~free(left_open)) > 20
    assert np.array_equal(free(full), free(holed))
    # The surface that was not read is the object's, too: fingers for others keep off.
    gone = (full.surface_label == 1) & (holed.surface_label == EMPTY)
    assert gone.any()
    assert np.all(holed.hidden_by[gone] == 1 << 1)
    assert np.array_equal(holed.hidden_by[~full.seen], full.hidden_by[~full.seen])


def test_a_background_hole_between_objects_continues_the_nearer_one():
    near = SyntheticBox(1, (0.55, -0.05, SUPPORT_Z_M + 0.1), (0.06, 0.1, 0.2))
    far = SyntheticBox(2, (0.75, 0.03, SUPPORT_Z_M + 0.1), (0.06, 0.1, 0.2))
    view = synthetic_capture([near, far])
    row = int(np.nonzero(view.label_image == 1)[0].mean())
    line = view.label_image[row]
    edge = int(np.flatnonzero((line[:-1] == 2) & (line[1:] != 2)).max())
    hole = slice(edge - 1, edge + 4)
    label = view.label_image.copy()
    label[row - 40 : row + 41, hole] = BACKGROUND
    holed = view.observation.depth_m.copy()
    holed[row - 40 : row + 41, hole] = 0
    depth, source = bridge_holes(holed, label, FOCAL_PX, HOLE_RAD)
    assert (label[row, edge - 2], label[row, edge + 4]) == (2, 1)
    assert np.allclose(depth[row, hole], view.observation.depth_m[row, edge + 4], rtol=0.02)
    assert np.all(label.ravel()[source[row, hole]] == 1)


def test_an_object_without_a_reading_is_not_looked_through(rng):
    """A dark pen that no sensor reads, thinner than a hole: the mask tells that there is something."""
    pen = SyntheticBox(3, (0.55, 0.0, SUPPORT_Z_M + 0.08), (0.012, 0.012, 0.16))
    view = synthetic_capture([pen, replace(BOX, center=(0.75, 0.0, SUPPORT_Z_M + 0.08))])
    unread = view.label_image == 3
    assert 3 < unread.any(axis=0).sum() < HOLE_RAD * FOCAL_PX
    depth, _ = bridge_holes(
        np.where(unread, np.float32(0), view.observation.depth_m), view.label_image, FOCAL_PX, HOLE_RAD
    )
    assert not np.any(depth[unread])
    volume = volume_of(view, unread)
    assert not np.any(free(volume)[inside(pen, GRID.centers())])
    # With a few readings it is taken to be as near as those, all the way.
    some = unread & (rng.random(unread.shape) > 0.05)
    volume = volume_of(view, some)
    assert not np.any(free(volume)[inside(pen, GRID.centers())])
