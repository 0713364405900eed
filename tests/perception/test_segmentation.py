"""Laws of clouds, normals and of what counts as visible."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from torc.errors import InputError
from torc.geometry.transforms import project
from torc.perception.noise import NoiseConfig, add_sensor_noise
from torc.perception.segmentation import PerceptionConfig
from torc.records import BACKGROUND, ROBOT, Capture
from torc.testing.contexts import see
from torc.testing.synthetic import (
    SyntheticBox,
    SyntheticCylinder,
    SyntheticSphere,
    inside,
    random_clutter,
    raycast,
    synthetic_capture,
)
from torc.workspace.workspace_files import load_workspace

BOX = SyntheticBox(1, (0.6, 0.0, 1.11), (0.1, 0.12, 0.12), (0.95, 0.0, 0.0, 0.31))
CAN = SyntheticCylinder(2, (0.6, 0.2, 1.11), 0.035, 0.12)
BALL = SyntheticSphere(3, (0.6, -0.2, 1.10), 0.05)
SHAPES = (BOX, CAN, BALL)


def perceive(capture, **config):
    return see(capture, PerceptionConfig(**config))


def with_depth(capture, depth_m):
    return replace(capture, observation=replace(capture.observation, depth_m=depth_m))


def angles_deg(a, b):
    return np.rad2deg(np.arccos(np.clip(np.sum(a * b, axis=1), -1, 1)))


def test_points_are_the_pixels_of_the_mask_on_the_surface(rng):
    shapes = random_clutter(rng, 15)
    scene = perceive(synthetic_capture(shapes))
    view = scene.observation
    assert len(scene.objects) > 8
    for o in scene.objects:
        assert np.all(scene.label_image[o.pixels[:, 0], o.pixels[:, 1]] == o.id)
        assert o.pixel_count == np.count_nonzero(scene.label_image == o.id)
        assert 0.9 * o.pixel_count <= len(o.points) <= o.pixel_count
        assert len(np.unique(o.pixels, axis=0)) == len(o.pixels)
        cols, rows, depths = project(o.points.astype(float), view.K, view.T_world_camera)
        assert np.allclose(np.stack([rows, cols], axis=1), o.pixels, atol=1e-2)
        assert np.allclose(depths, view.depth_m[o.pixels[:, 0], o.pixels[:, 1]], atol=1e-5)
        assert np.all(inside(shapes[o.id], o.points, 1e-5))


@pytest.mark.parametrize("shape", SHAPES)
def test_normals_are_unit_and_right_to_a_few_degrees(shape):
    scene = perceive(synthetic_capture(SHAPES))
    o = scene.object(shape.id)
    truth = raycast(SHAPES).normals[o.pixels[:, 0], o.pixels[:, 1]]
    errors = angles_deg(o.normals, truth)
    assert np.allclose(np.linalg.norm(o.normals, axis=1), 1, atol=1e-5)
    assert np.median(errors) < 2.0
    assert np.quantile(errors, 0.9) < 10.0
    # Towards the camera, without exception.
    eye = scene.observation.T_world_camera[:3, 3]
    assert np.all(np.sum(o.normals * (eye - o.points), axis=1) > 0)


def test_normals_next_to_the_ridges_of_a_box_belong_to_one_of_its_faces():
    scene = perceive(synthetic_capture([BOX]))
    o = scene.object(1)
    truth = raycast([BOX]).normals[o.pixels[:, 0], o.pixels[:, 1]]
    assert np.mean(angles_deg(o.normals, truth) > 10) < 0.02


def test_points_between_two_surfaces_are_dropped():
    view = synthetic_capture([BOX])
    depth = view.observation.depth_m.copy()
    rows, cols = np.nonzero(view.label_image == 1)
    # The mask's pixels right of the box's left rim, smeared half way to what lies behind.
    left = {r: cols[rows == r].min() for r in np.unique(rows)[5:-40]}
    smeared = [(r, c) for r, c in left.items() if depth[r, c - 1] - depth[r, c + 1] > 0.08]
    assert len(smeared) > 10
    for r, c in smeared:
        depth[r, c] = (depth[r, c - 1] + depth[r, c + 1]) / 2
    scene = perceive(with_depth(view, depth))
    kept = {tuple(p) for p in scene.object(1).pixels}
    assert not kept & set(smeared)
    assert np.all(inside(BOX, scene.object(1).points, 1e-4))


def test_a_mask_that_bleeds_over_the_background_keeps_to_its_surface():
    view = synthetic_capture([BALL, CAN])
    label = view.label_image.copy()
    for object_id in (2, 3):
        mask = view.label_image == object_id
        label[np.roll(mask, 1, axis=1) & (label == BACKGROUND)] = object_id
    scene = perceive(replace(view, label_image=label))
    clean = perceive(view)
    for shape in (BALL, CAN):
        o = scene.object(shape.id)
        outside = ~inside(shape, o.points, 1e-4)
        # Where the ball touches the ground there is no jump: a few points of the table beside it stay.
        assert outside.mean() < 0.02
        assert len(o.points) > 0.95 * len(clean.object(shape.id).points)


def test_readings_out_of_range_are_none():
    view = synthetic_capture([BOX])
    depth = view.observation.depth_m.copy()
    bad = np.zeros(depth.shape, dtype=bool)
    bad[200:260, 300:340] = True
    for value in (np.nan, np.inf, -np.inf, 0.0, 0.05, 3.5, -1.0):
        depth[bad] = value
        scene = perceive(with_depth(view, depth), max_depth_m=3.0)
        o = scene.object(1)
        assert not np.any(bad[o.pixels[:, 0], o.pixels[:, 1]])
        assert o.pixel_count == np.count_nonzero(view.label_image == 1)
        assert np.all(np.isfinite(scene.background_points))


def test_slivers_are_not_reported_but_stay_obstacles():
    view = synthetic_capture([BOX])
    label = np.full_like(view.label_image, BACKGROUND)
    rows, cols = np.nonzero(view.label_image == 1)
    label[rows, cols] = 1
    label[rows[500:512], cols[500:512]] = 9
    scene = perceive(replace(view, label_image=label), min_pixels=15)
    assert scene.ids == (1,)
    assert np.count_nonzero(scene.label_image == 9) == 12
    sliver = inside(BOX, scene.background_points, 1e-4)
    assert 8 <= sliver.sum() <= 12
    assert perceive(replace(view, label_image=label), min_pixels=12).ids == (1, 9)


def test_the_target_is_known_from_its_own_threshold_on():
    target = replace(BOX, id=0)
    view = synthetic_capture([target, CAN])
    n = int(np.count_nonzero(view.label_image == 0))
    assert perceive(view, min_target_pixels=n).target_id == 0
    hidden = perceive(view, min_target_pixels=n + 1)
    assert hidden.target_id is None
    assert hidden.ids == (2,)
    assert perceive(synthetic_capture([CAN])).target_id is None


def test_background_is_the_table_without_the_robot():
    view = synthetic_capture([CAN])
    label = view.label_image.copy()
    label[:, 320:] = np.where(label[:, 320:] == BACKGROUND, np.int16(ROBOT), label[:, 320:])
    mount = load_workspace().camera
    scene = perceive(replace(view, label_image=label))
    cols, _, _ = project(scene.background_points.astype(float), mount.K, mount.T_world_camera)
    assert cols.max() < 320
    x, y, z = scene.background_points.T
    on_table = (x > 0.45) & (x < 1.05) & (np.abs(y) < 0.3) & (z > 0.95)  # not the floor before the table
    assert on_table.sum() > 1000
    assert np.allclose(z[on_table], load_workspace().support_z_m, atol=1e-4)


def test_an_image_without_objects_gives_an_empty_scene():
    empty = synthetic_capture([])
    scene = perceive(empty)
    assert scene.objects == ()
    assert scene.target_id is None
    dark = perceive(with_depth(empty, np.zeros_like(scene.observation.depth_m)))
    assert dark.background_points.shape == (0, 3)


@pytest.mark.usefixtures("any_arrays")
def test_unusable_input_is_named():
    view = synthetic_capture([BOX])
    with pytest.raises(InputError, match="no label image"):
        perceive(Capture(view.observation))
    with pytest.raises(InputError, match="sizes differ"):
        perceive(replace(view, label_image=view.label_image[:-1]))
    with pytest.raises(InputError, match="outside"):
        perceive(replace(view, label_image=np.full_like(view.label_image, 64)))
    with pytest.raises(InputError, match="stride"):
        PerceptionConfig(stride=0)
    with pytest.raises(InputError, match="range"):
        PerceptionConfig(min_depth_m=3.0, max_depth_m=1.0)


def test_the_rim_of_a_mask_that_is_too_small_is_no_background():
    view = synthetic_capture(SHAPES)
    small = add_sensor_noise(view, NoiseConfig(mask_erosion_px=2), np.random.default_rng(0))
    on_shapes = [
        sum(np.count_nonzero(inside(s, scene.background_points, 1e-4)) for s in SHAPES)
        for scene in (perceive(small, background_stride=1), perceive(small, background_stride=1, rim_px=3))
    ]
    assert on_shapes[0] > 100
    assert on_shapes[1] == 0


def fattened(shape_id, px):
    """A view in which what lies well behind an object is measured on its outermost pixels, as stereo matchers do; and
    which pixels these are.
    """
    view = synthetic_capture(SHAPES)
    mask = view.label_image == shape_id
    inner = cv2.erode(mask.astype(np.uint8), np.ones((2 * px + 1, 2 * px + 1), np.uint8)) > 0
    without = raycast([s for s in SHAPES if s.id != shape_id]).depth_m
    depth = view.observation.depth_m
    wrong = mask & ~inner & (without - depth > 0.03)
    return with_depth(view, np.where(wrong, without, depth)), wrong


@pytest.mark.parametrize("shape", SHAPES)
def test_readings_of_what_lies_behind_along_a_masks_edge_are_none(shape):
    view, wrong = fattened(shape.id, 3)
    plain, rough = perceive(view, edge_slope=4.0), perceive(view, edge_slope=4.0, piece_px=5)
    taken = [np.count_nonzero(wrong[tuple(s.object(shape.id).pixels.T)]) for s in (plain, rough)]
    assert np.count_nonzero(wrong) > 100
    assert taken[0] > 0.5 * np.count_nonzero(wrong)
    assert taken[1] < 0.03 * np.count_nonzero(wrong)
    kept = (view.label_image == shape.id) & ~wrong
    assert np.count_nonzero(rough.observation.depth_m[kept]) > 0.98 * np.count_nonzero(kept)
    background = view.label_image < 0
    assert np.all(rough.observation.depth_m[background] == view.observation.depth_m[background])


@pytest.mark.parametrize(("offset_m", "kept"), [(1.5, False), (-0.1, True)])
def test_a_tiny_piece_far_behind_the_rest_may_reach_further_into_the_mask(offset_m, kept):
    """As where a side is seen too flat to be matched. In front of the rest it may be a part that sticks out."""
    view = synthetic_capture([BOX])
    rows, cols = np.nonzero(view.label_image == BOX.id)
    strip = (rows > rows.mean()) & (rows < rows.mean() + 15) & (cols < cols.min() + 8)
    depth = view.observation.depth_m.copy()
    depth[rows[strip], cols[strip]] += offset_m
    seen = perceive(with_depth(view, depth), piece_px=5).observation.depth_m[rows[strip], cols[strip]]
    assert np.count_nonzero(strip) > 50
    assert np.all(seen > 0) if kept else np.all(seen == 0)


def test_an_object_that_something_in_front_cuts_in_two_keeps_both_parts():
    post = SyntheticBox(0, (0.50, 0.0, 1.2), (0.02, 0.03, 0.3))
    view = synthetic_capture([post, BOX])
    plain, rough = perceive(view), perceive(view, piece_px=5)
    assert len(rough.object(1).points) == len(plain.object(1).points)
    left = np.any(rough.object(1).pixels[:, 1] < 280)
    right = np.any(rough.object(1).pixels[:, 1] > 360)
    assert left
    assert right


def test_small_objects_keep_what_there_is_of_them():
    view = synthetic_capture([SyntheticBox(1, (0.7, 0.0, 1.06), (0.01, 0.15, 0.02))])
    assert len(perceive(view, piece_px=5).object(1).points) == len(perceive(view).object(1).points)


def twice_as_fine(view):
    """The same view by a camera with four pixels for each."""
    o = view.observation
    K = np.array(
        [
            [2 * o.K[0, 0], 0, 2 * o.K[0, 2] + 0.5],
            [0, 2 * o.K[1, 1], 2 * o.K[1, 2] + 0.5],
            [0, 0, 1],
        ]
    )
    rgb, depth_m, label = (a.repeat(2, 0).repeat(2, 1) for a in (o.rgb, o.depth_m, view.label_image))
    return Capture(replace(o, rgb=rgb, depth_m=depth_m, K=K), label)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_finer_camera_sees_the_same_clouds_with_the_same_settings(shape):
    view, wrong = fattened(shape.id, 3)
    settings = {"edge_slope": 4.0, "piece_px": 5, "rim_px": 2}
    plain, fine = perceive(view, **settings), perceive(twice_as_fine(view), **settings)
    torn = wrong.repeat(2, 0).repeat(2, 1)
    assert np.count_nonzero(torn[tuple(fine.object(shape.id).pixels.T)]) < 0.03 * np.count_nonzero(torn)
    for s in (plain, fine):
        assert s.ids == tuple(sorted(o.id for o in SHAPES))
    for a, b in zip(plain.objects, fine.objects, strict=True):
        assert len(b.points) == pytest.approx(4 * len(a.points), rel=0.03)
        np.testing.assert_allclose(b.points.min(axis=0), a.points.min(axis=0), atol=0.004)
        np.testing.assert_allclose(b.points.max(axis=0), a.points.max(axis=0), atol=0.004)
        assert b.pixel_count == 4 * a.pixel_count
    assert len(fine.background_points) == pytest.approx(4 * len(plain.background_points), rel=0.03)


def test_settings_in_pixels_grow_with_the_picture_alone():
    rough = PerceptionConfig.rough()
    assert rough.at((480, 640)) is rough.at((240, 424)) is rough
    fine = rough.at((960, 1280))
    assert (fine.rim_px, fine.piece_px, fine.normal_radius_px) == (4, 10, 6)
    assert fine.min_pixels == 4 * rough.min_pixels
    # What is counted in points follows the picture's size where it is counted.
    assert (fine.edge_slope, fine.min_points, fine.stride) == (
        rough.edge_slope,
        rough.min_points,
        rough.stride,
    )
