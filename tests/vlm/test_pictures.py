"""Laws of the pictures that a model is sent."""

from itertools import combinations

import cv2
import numpy as np
import pytest

from torc.drawing.label_places import place_labels
from torc.drawing.marking import SMALL_SHARE, mark_image, number_boxes
from torc.errors import InputError
from torc.io.pictures import png_bytes
from torc.testing.contexts import see
from torc.testing.synthetic import random_clutter, synthetic_capture
from torc.vlm.picture_config import MARKS, PictureConfig
from torc.vlm.pictures import ACROSS_PX, pictures_of, shown_part

WAYS = [
    PictureConfig("outlines"),
    PictureConfig("outlines", crop_px=10),
    PictureConfig("outlines", crop_px=0, longest_side_px=900),
    PictureConfig("outlines", longest_side_px=500),
]


def scene_of(seed, count=25):
    return see(synthetic_capture(random_clutter(np.random.default_rng(seed), count)))


def decoded(png):
    return cv2.cvtColor(cv2.imdecode(np.frombuffer(png, np.uint8), 1), cv2.COLOR_BGR2RGB)


def numbers_read(image, ids):
    """Where each number is found, by nothing but the pixels: (row, col, height, width) of its box."""
    found = {}
    gray = image.max(axis=2)
    for i in ids:
        box, _ = number_boxes(image.shape[:2], {i: i}, small=True)[i]
        different = cv2.matchTemplate(gray.astype(np.float32), box.astype(np.float32), cv2.TM_SQDIFF)
        row, col = np.unravel_index(int(np.argmin(different)), different.shape)
        height, width = box.shape
        patch = image[row : row + height, col : col + width]
        if np.array_equal(patch, np.repeat(box[..., None], 3, axis=2)):
            found[i] = (int(row), int(col), height, width)
    return found


def overlap(a, b):
    rows = min(a[0] + a[2], b[0] + b[2]) > max(a[0], b[0])
    return rows and min(a[1] + a[3], b[1] + b[3]) > max(a[1], b[1])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("config", WAYS, ids=lambda c: "-".join(c.words))
def test_every_visible_object_has_its_number_and_none_covers_another(seed, config):
    scene = scene_of(seed)
    image = decoded(pictures_of(scene, config)[0].png)
    found = numbers_read(image, scene.ids)
    assert sorted(found) == list(scene.ids)
    assert not any(overlap(a, b) for a, b in combinations(found.values(), 2))


@pytest.mark.parametrize("config", WAYS, ids=lambda c: "-".join(c.words))
def test_colours_outside_outlines_and_squares_are_untouched_to_the_bit(config):
    scene = scene_of(4, 15)
    rgb, label = shown_part(scene, config)
    image = decoded(pictures_of(scene, config)[0].png)
    allowed = np.zeros(label.shape, dtype=bool)
    thickest = 2
    for row in range(-thickest, thickest + 1):  # pixels whose neighbourhood is not all of one label
        for col in range(-thickest, thickest + 1):
            moved = np.roll(label, (row, col), axis=(0, 1))
            allowed |= (moved != label) & (label >= 0)
    allowed[:thickest] = allowed[-thickest:] = allowed[:, :thickest] = allowed[:, -thickest:] = True
    boxes = number_boxes(label.shape, {i: i for i in scene.ids}, small=True)
    places = place_labels(label, {i: (a.shape, b.shape) for i, (a, b) in boxes.items()}, SMALL_SHARE)
    lines = np.zeros(label.shape, dtype=np.uint8)
    for place in places.values():
        allowed[place.row : place.row + place.size[0], place.col : place.col + place.size[1]] = True
        if place.leader:
            middle = (place.col + place.size[1] // 2, place.row + place.size[0] // 2)
            cv2.line(lines, middle, place.anchor[::-1], 1, 3)
    changed = np.any(image != rgb, axis=2)
    assert changed.any()
    assert not np.any(changed & ~allowed & (lines == 0))


@pytest.mark.parametrize("marks", ["tinted", "outlines"])
def test_the_plain_picture_is_the_camera_s_own(marks):
    scene = scene_of(5)
    marked, plain = pictures_of(scene, PictureConfig(marks, plain=True))
    assert np.array_equal(decoded(plain.png), scene.observation.rgb)
    assert (marked.shows, plain.shows) == ("marked", "plain")
    assert (marked.width, marked.height) == (plain.width, plain.height) == (640, 480)


def test_the_default_is_the_marked_image_byte_for_byte():
    scene = scene_of(6)
    (only,) = pictures_of(scene, PictureConfig())
    assert only.png == png_bytes(mark_image(scene))


@pytest.mark.parametrize("seed", range(3))
def test_a_crop_keeps_every_object_whole_under_its_id(seed):
    scene = scene_of(seed)
    rgb, label = shown_part(scene, PictureConfig(crop_px=7))
    assert label.size < scene.label_image.size
    for i in scene.ids:
        assert np.count_nonzero(label == i) == np.count_nonzero(scene.label_image == i)
        colors = scene.observation.rgb[scene.label_image == i]
        assert np.array_equal(rgb[label == i], colors)


@pytest.mark.parametrize(("seed", "objects"), [(2, 30), (5, 1), (6, 12)])
def test_clear_pictures_show_the_objects_large_and_lose_none(seed, objects):
    scene = scene_of(seed, objects)
    marked, plain = pictures_of(scene, PictureConfig("clear", plain=True))
    rgb, label = shown_part(scene, PictureConfig("clear"))
    assert max(np.ptp(at) + 1 for at in np.nonzero(label >= 0)) >= 0.98 * ACROSS_PX
    assert max(label.shape) <= 1.6 * ACROSS_PX
    assert set(np.unique(label).tolist()) - {-1} == set(scene.ids)
    assert np.array_equal(decoded(plain.png), rgb)
    assert (marked.width, marked.height) == (plain.width, plain.height) == label.shape[::-1]


def test_a_side_and_a_margin_of_ones_own_are_kept_in_clear_pictures():
    marked = pictures_of(scene_of(6), PictureConfig("clear", crop_px=3, longest_side_px=640))[0]
    assert max(marked.width, marked.height) == 640


@pytest.mark.parametrize("marks", MARKS)
@pytest.mark.parametrize("side", [64, 150, 1000])
def test_no_object_is_lost_in_another_resolution(side, marks):
    scene = scene_of(2, 30)
    rgb, label = shown_part(scene, PictureConfig(marks, longest_side_px=side))
    assert max(label.shape) == side
    assert rgb.shape[:2] == label.shape
    assert set(np.unique(label).tolist()) - {-1} == set(scene.ids)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"marks": "glitter"}, "tinted, outlines, clear"),
        ({"crop_px": -1}, "at least 0"),
        ({"longest_side_px": 10}, "64 to 4096"),
    ],
)
def test_what_cannot_be_shown_is_refused(options, told):
    with pytest.raises(InputError, match=told):
        PictureConfig(**options)


def test_what_is_said_of_the_pictures_is_so():
    said = PictureConfig("outlines", True, 5).sentences
    assert "tinted" not in said
    assert "second" in said
    assert "cut to" in said
    assert "second" not in PictureConfig().sentences
