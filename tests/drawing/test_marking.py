"""Laws of the marked image."""

from itertools import combinations

import cv2
import numpy as np
import pytest

from torc.drawing.label_places import place_labels
from torc.drawing.marking import mark_image, number_image, target_in_red
from torc.drawing.palette import object_color
from torc.errors import InputError
from torc.records import MAX_OBJECTS
from torc.testing.contexts import see
from torc.testing.synthetic import SyntheticBox, random_clutter, synthetic_capture

SIZES = ((19, 19), (15, 15))


def scene_of(shapes):
    return see(synthetic_capture(shapes))


def box_slices(place):
    return slice(place.row, place.row + place.size[0]), slice(place.col, place.col + place.size[1])


def overlap(a, b):
    rows = min(a.row + a.size[0], b.row + b.size[0]) > max(a.row, b.row)
    return rows and min(a.col + a.size[1], b.col + b.size[1]) > max(a.col, b.col)


@pytest.mark.parametrize("seed", range(5))
def test_every_mask_gets_a_place_and_no_two_overlap(seed):
    scene = scene_of(random_clutter(np.random.default_rng(seed), 30))
    places = place_labels(scene.label_image, dict.fromkeys(scene.ids, SIZES))
    assert tuple(places) == scene.ids
    assert not any(overlap(a, b) for a, b in combinations(places.values(), 2))
    for i, place in places.items():
        rows, cols = box_slices(place)
        assert place.row >= 0
        assert place.col >= 0
        assert rows.stop <= scene.label_image.shape[0]
        assert cols.stop <= scene.label_image.shape[1]
        assert scene.label_image[place.anchor] == i
        center = scene.label_image[place.row + place.size[0] // 2, place.col + place.size[1] // 2]
        assert place.leader or center == i


def test_a_mask_too_small_is_named_beside_itself():
    label = np.full((100, 120), -1, dtype=np.int16)
    label[50:55, 50:55] = 2
    place = place_labels(label, {2: SIZES})[2]
    assert place.leader
    assert np.all(label[box_slices(place)] == -1)
    assert abs(place.row - 50) < 40


def test_the_picture_is_untouched_but_for_the_marks_and_repeats(rng):
    scene = scene_of(random_clutter(rng, 12))
    before = scene.observation.rgb.copy()
    image = mark_image(scene)
    assert image.dtype == np.uint8
    assert np.array_equal(image, mark_image(scene))
    assert np.array_equal(scene.observation.rgb, before)
    ids = np.isin(scene.label_image, scene.ids)
    far_from_objects = np.ones_like(ids)
    rows, cols = np.nonzero(ids)
    far_from_objects[max(rows.min() - 60, 0) : rows.max() + 60, max(cols.min() - 60, 0) : cols.max() + 60] = (
        False
    )
    assert np.array_equal(image[far_from_objects], before[far_from_objects])
    assert np.mean(np.any(image != before, axis=2)[~ids]) < 0.02


def test_outlines_have_the_object_color_and_boxes_are_black_with_white():
    scene = scene_of(
        [SyntheticBox(0, (0.55, 0, 1.13), (0.15, 0.15, 0.16)), SyntheticBox(5, (0.6, 0.25, 1.1), (0.1,) * 3)]
    )
    image = mark_image(scene)
    for i in (0, 5):
        mask = scene.label_image == i
        assert np.all(image == object_color(i), axis=2)[mask].sum() > 100
        assert np.all(image == 0, axis=2)[mask].sum() > 100
        assert np.all(image == 255, axis=2)[mask].sum() > 10


def test_highlighting_brings_out_one_object(rng):
    scene = scene_of(random_clutter(rng, 8))
    chosen = scene.ids[2]
    image, plain = mark_image(scene, highlight=chosen), mark_image(scene)
    color = object_color(chosen)
    assert np.sum(np.all(image == color, axis=2)) > 1.3 * np.sum(np.all(plain == color, axis=2))
    with pytest.raises(InputError, match="highlight"):
        mark_image(scene, highlight=63)


def test_what_was_drawn_before_changes_nothing():
    shapes = random_clutter(np.random.default_rng(2), 8)
    scene = scene_of(shapes)
    for marks in ({}, {"highlight": 3}, {"labels": {1: 40, 2: 7}}, {"highlight": 2, "labels": {3: 11}}):
        np.testing.assert_array_equal(mark_image(scene, **marks), mark_image(scene_of(shapes), **marks))


def test_all_numbers_look_different():
    pictures = {number_image(n, 13).tobytes() for n in range(MAX_OBJECTS)}
    assert len(pictures) == MAX_OBJECTS
    assert all(number_image(n, 13).shape[0] == 13 for n in range(MAX_OBJECTS))


def test_colors_differ_and_red_is_the_target():
    colors = np.array([object_color(i) for i in range(MAX_OBJECTS)], dtype=float)
    distance = np.linalg.norm(colors[:, None] - colors[None], axis=2)
    assert np.all(distance[~np.eye(MAX_OBJECTS, dtype=bool)] > 15)
    r, g, b = colors[0]
    assert r > 200
    assert max(g, b) < 60
    assert np.all(distance[0, 1:] > 80)
    with pytest.raises(InputError, match="no colour"):
        object_color(64)


def test_a_target_of_another_number_is_drawn_as_number_0_would_be():
    label = np.full((60, 80), -1, np.int16)
    label[10:30, 10:30], label[10:30, 45:65] = 3, 7
    red, numbers = target_in_red(label, {3: 3, 7: 7}, 7)
    assert numbers == {0: 7, 3: 3}
    np.testing.assert_array_equal(red == 0, label == 7)
    np.testing.assert_array_equal(red == 3, label == 3)
    assert target_in_red(label, {3: 3, 7: 7}, None)[1] == {3: 3, 7: 7}


def curved_masks():
    """Rings, crescents, horseshoes and combs: their centres of mass lie outside them, or near their rims."""
    y, x = np.mgrid[:200, :200] - 100
    radius = np.hypot(x, y)
    yield (radius < 80) & (radius > 50)
    yield (radius < 80) & (np.hypot(x - 30, y) > 62)
    yield (radius < 80) & (radius > 45) & (y < 20)
    yield (np.abs(x) < 80) & (np.abs(y) < 80) & ((x // 25) % 2 == 0)
    yield (np.abs(x) < 80) & (np.abs(y) < 80) & ((np.abs(x) > 50) | (y > 50))


@pytest.mark.parametrize("mask", list(curved_masks()))
@pytest.mark.parametrize("neighbours", [False, True])
def test_numbers_of_curved_masks_stand_wholly_inside_them(mask, neighbours):
    """Also where another object lies in the hole and in the notches, with a number of its own."""
    label = np.where(mask, 3, 8 if neighbours else -1).astype(np.int16)
    places = place_labels(label, {3: SIZES, 8: SIZES})
    assert not places[3].leader
    assert np.all(label[box_slices(places[3])] == 3)
    if neighbours:
        assert not overlap(places[3], places[8])


@pytest.mark.parametrize("seed", range(5))
def test_a_number_with_room_in_its_mask_covers_no_other_object(seed):
    scene = scene_of(random_clutter(np.random.default_rng(seed), 12))
    places = place_labels(scene.label_image, dict.fromkeys(scene.ids, SIZES))
    for i, place in places.items():
        height, width = SIZES[1]
        mask = (scene.label_image == i).astype(np.uint8)
        window = np.ones((height + 8, width + 8))
        if cv2.erode(mask, window, borderType=cv2.BORDER_CONSTANT, borderValue=0).any():
            assert np.all(scene.label_image[box_slices(place)] == i)
