"""The part of a picture that is looked at: all that rises, with a rim, and not more than needs be."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from torc.geometry.transforms import masked_points
from torc.perception.embedded.inputs import PIXEL_M, View, cut, rising, window_on
from torc.perception.embedded.perception import uncut
from torc.perception.image_kernels import heights_within
from torc.testing.contexts import box
from torc.testing.synthetic import random_clutter, synthetic_capture
from torc.workspace.workspace_files import load_workspace

WORKSPACE = load_workspace()


def view_of(shapes):
    capture = synthetic_capture(shapes)
    o = capture.observation
    return View(o.rgb, o.depth_m, o.K, o.T_world_camera, WORKSPACE.support_z_m), capture.label_image


def test_what_rises_is_the_objects():
    view, label = view_of(random_clutter(np.random.default_rng(3), 10))
    found = rising(view, WORKSPACE.grid)
    assert np.count_nonzero(found & (label >= 0)) > 0.9 * np.count_nonzero(label >= 0)
    assert np.count_nonzero(found & (label < 0)) < 0.02 * np.count_nonzero(found)


def test_the_window_holds_all_objects_at_about_the_networks_scale():
    view, label = view_of(random_clutter(np.random.default_rng(3), 10))
    window, height, width = window_on(view, WORKSPACE.grid, 32)
    assert height % 32 == width % 32 == 0
    rows, cols = np.nonzero(label >= 0)
    last_row, last_col = window.row + height / window.scale, window.col + width / window.scale
    assert window.row <= rows.min()
    assert rows.max() < last_row
    assert window.col <= cols.min()
    assert cols.max() < last_col
    z = np.median(view.depth_m[label >= 0])
    assert abs(z / view.K[0, 0] / window.scale - PIXEL_M) < 0.2 * PIXEL_M


def test_heights_are_those_of_the_points_within_the_outline():
    view, _ = view_of(random_clutter(np.random.default_rng(4), 8))
    depth_m = np.where(np.random.default_rng(5).random(view.depth_m.shape) < 0.1, 0, view.depth_m)
    points = masked_points(depth_m >= 0, depth_m, view.K, view.T_world_camera).reshape(*depth_m.shape, 3)
    low, high = WORKSPACE.grid.origin[:2], WORKSPACE.grid.upper[:2]
    inside = ((points[..., :2] >= low) & (points[..., :2] <= high)).all(axis=-1) & (depth_m > 0)
    found = heights_within(depth_m, view.K, view.T_world_camera, np.array([low, high]))
    assert_allclose(found, np.where(inside, points[..., 2], np.nan), atol=1e-12)


def test_an_empty_table_has_none_nor_has_one_that_is_rough():
    view, _ = view_of(())
    assert window_on(view, WORKSPACE.grid, 32) is None
    rng = np.random.default_rng(0)
    rough = replace(
        view, depth_m=(view.depth_m + rng.normal(0, 0.002, view.depth_m.shape)).astype(np.float32)
    )
    assert np.count_nonzero(rising(rough, WORKSPACE.grid)) < 0.002 * rough.depth_m.size


def test_what_stands_outside_of_the_grid_does_not_count():
    view, label = view_of((box(1, 0.62, -0.1, (0.05, 0.05, 0.1)), box(2, 0.62, 0.9, (0.05, 0.05, 0.1))))
    found = rising(view, WORKSPACE.grid)
    assert found[label == 1].mean() > 0.8
    assert not found[label == 2].any()


def test_two_hundred_objects_make_a_coarser_patch_not_a_larger_one():
    wide = replace(WORKSPACE.grid, origin=np.array([0.0, -3.0, 1.05]), shape=(300, 600, 42))
    shapes = tuple(
        box(1 + i % 60, 0.45 + 0.04 * (i // 20), -0.9 + 0.09 * (i % 20), (0.03, 0.05, 0.06))
        for i in range(200)
    )
    view, _ = view_of(shapes)
    window, height, width = window_on(view, wide, 32)
    assert height * width < 520_000
    assert window.scale < 1.3


def test_labels_go_to_the_patch_and_back():
    view, label = view_of(random_clutter(np.random.default_rng(5), 8))
    window, height, width = window_on(view, WORKSPACE.grid, 32)
    rows, cols = (np.rint(v).astype(int) for v in window.source(height, width))
    inside = (rows[:, None] >= 0) & (rows[:, None] < 480) & (cols >= 0) & (cols < 640)
    patch_label = np.where(inside, label[np.clip(rows, 0, 479)[:, None], np.clip(cols, 0, 639)], -1).astype(
        np.int16
    )
    back = uncut(patch_label, window, label.shape)
    differ = (back >= 0) != (label >= 0)
    assert differ.mean() < 0.004
    both = (back >= 0) & (label >= 0)
    assert (back[both] == label[both]).mean() > 0.97
    assert cut(view, window, height, width).depth_m.shape == patch_label.shape
