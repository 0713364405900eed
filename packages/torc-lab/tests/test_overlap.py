"""How far a scene is laid out as it was: against shapes whose place is known."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.noise import add_sensor_noise, stereo_camera
from torc.records import Capture
from torc.testing.synthetic import SyntheticBox, synthetic_capture
from torc.workspace.workspace_files import load_workspace
from torc_lab.scenes.hints import hint, shift_m
from torc_lab.scenes.overlap import measure_overlap
from torc_lab.scenes.overlay import overlay, state_of

WORKSPACE = load_workspace()
GRID, TOP_M = WORKSPACE.grid, WORKSPACE.support_z_m
COLORS = np.array([[150, 120, 90], [200, 40, 40], [40, 60, 200], [40, 160, 60]], np.uint8)


def box(k, x, y, size=(0.08, 0.1, 0.12)):
    return SyntheticBox(k, (x, y, TOP_M + size[2] / 2), size)


BOXES = (box(1, 0.7, -0.2), box(2, 0.75, 0.15))


def picture(*boxes, colors=COLORS):
    """A snapshot in which every object has a colour of its own."""
    return capture(*boxes, colors=colors).observation


def capture(*boxes, colors=COLORS):
    """The same with the objects' masks."""
    seen = synthetic_capture(list(boxes))
    rgb = colors[np.clip(seen.label_image, 0, 3)].astype(np.uint8)
    return replace(seen, observation=replace(seen.observation, rgb=rgb))


REFERENCE = capture(*BOXES)
SEEN = REFERENCE.observation


def test_what_did_not_move_overlaps_wholly_with_noise_or_other_light(rng):
    assert measure_overlap(REFERENCE, SEEN, GRID).objects == {1: 1.0, 2: 1.0}
    darker = replace(SEEN, rgb=(0.7 * SEEN.rgb).astype(np.uint8))
    noisy = add_sensor_noise(Capture(darker), stereo_camera(), rng).observation
    found = measure_overlap(REFERENCE, noisy, GRID)
    assert min(found.objects.values()) > 0.95
    assert found.fits(0.9)
    assert found.faults(0.9) == []


def test_lamps_of_another_colour_move_nothing():
    warm = replace(SEEN, rgb=(SEEN.rgb * [1.0, 0.85, 0.55]).astype(np.uint8))
    assert min(measure_overlap(REFERENCE, warm, GRID).objects.values()) > 0.95


@pytest.mark.parametrize("shift_m", [0.01, 0.02, 0.03, 0.04])
def test_the_number_is_the_overlap_of_where_it_was_and_is(shift_m):
    """Before the camera, where no side of the box shows, that is what the masks say."""
    reference, moved = (capture(box(1, 0.7, y), BOXES[1]) for y in (-0.02, -0.02 + shift_m))
    found = measure_overlap(reference, moved.observation, GRID)
    then, now = (seen.label_image == 1 for seen in (reference, moved))
    true = np.count_nonzero(then & now) / np.count_nonzero(then | now)
    assert found.objects[1] == pytest.approx(true, abs=0.07)
    assert found.objects[2] == 1.0
    assert found.fits(0.8) == (shift_m < 0.015)
    if not found.fits(0.8):
        assert "object 1 overlaps by" in found.faults(0.8)[0]


def test_of_an_object_of_which_a_side_shows_more_is_asked():
    """The side stands elsewhere, where its mask still covers it."""
    moved = capture(box(1, 0.7, -0.17), BOXES[1])
    then, now = (seen.label_image == 1 for seen in (REFERENCE, moved))
    true = np.count_nonzero(then & now) / np.count_nonzero(then | now)
    assert 0.3 < measure_overlap(REFERENCE, moved.observation, GRID).objects[1] < true


def test_an_object_that_is_gone_or_another_one_is_noticed():
    assert measure_overlap(REFERENCE, picture(BOXES[1]), GRID).objects[1] < 0.1
    swapped = picture(*BOXES, colors=COLORS[[0, 2, 1, 3]])
    assert max(measure_overlap(REFERENCE, swapped, GRID).objects.values()) < 0.3
    lower = picture(box(1, 0.7, -0.2, (0.08, 0.1, 0.06)), BOXES[1])
    assert measure_overlap(REFERENCE, lower, GRID).objects[1] < 0.5


def test_a_further_object_is_noticed_on_the_table_alone():
    more = measure_overlap(REFERENCE, picture(*BOXES, box(3, 0.85, -0.4, (0.05, 0.05, 0.05))), GRID)
    assert more.objects == {1: 1.0, 2: 1.0}
    assert more.new
    assert not more.fits(0.8)
    assert "something stands where nothing stood" in more.faults(0.8)[0]
    aside = measure_overlap(REFERENCE, picture(*BOXES, box(3, 2.0, 1.2, (0.3, 0.3, 1.0))), GRID)
    assert not aside.new  # a person who stands behind the table


def test_a_camera_that_moved_is_noticed():
    sunk = replace(SEEN, depth_m=(1.05 * SEEN.depth_m).astype(np.float32))
    found = measure_overlap(REFERENCE, sunk, GRID)
    assert found.table_moved
    assert not found.fits(0.1)
    assert "has the camera moved" in " ".join(found.faults(0.1))


def test_where_depth_has_no_reading_colour_judges():
    """As glass and polished metal have it."""
    hole = np.where(REFERENCE.label_image == 1, 0, SEEN.depth_m).astype(np.float32)
    blind = replace(REFERENCE, observation=replace(SEEN, depth_m=hole))
    assert measure_overlap(blind, blind.observation, GRID).objects[1] == 1.0
    assert measure_overlap(blind, picture(BOXES[1]), GRID).objects[1] < 0.1


def test_pictures_that_cannot_be_compared_are_refused():
    small = replace(SEEN, rgb=SEEN.rgb[::2, ::2], depth_m=SEEN.depth_m[::2, ::2])
    with pytest.raises(InputError, match="same camera"):
        measure_overlap(REFERENCE, small, GRID)
    longer = replace(SEEN, K=SEEN.K * np.array([[1.2], [1.2], [1.0]]))
    with pytest.raises(InputError, match="same camera"):
        measure_overlap(REFERENCE, longer, GRID)
    with pytest.raises(InputError, match="no objects"):
        measure_overlap(Capture(SEEN), SEEN, GRID)


def test_the_overlay_outlines_each_object_by_how_it_lies():
    moved = picture(box(1, 0.7, -0.12), BOXES[1])
    found = measure_overlap(REFERENCE, moved, GRID)
    assert [state_of(found.objects[k], 0.8) for k in (1, 2)] == ["bad", "good"]
    image = overlay(REFERENCE, moved, found, 0.8, 960)
    assert image.shape[1] == 960
    colors = {tuple(c) for c in image.reshape(-1, 3).tolist()}
    assert {(255, 60, 20), (0, 200, 120)} <= colors
    assert (240, 170, 0) not in colors
    assert state_of(0.6, 0.8) == "near"


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.03), (0.0, -0.04), (0.03, 0.0), (-0.02, 0.02)])
def test_a_hint_says_where_it_is_instead(dx, dy):
    """The camera looks along x, and down; y is to its left."""
    moved = picture(box(1, 0.7 + dx, -0.2 + dy), BOXES[1])
    right_m, behind_m = shift_m(REFERENCE, moved, 1)
    down = SEEN.T_world_camera[0, 2]
    assert right_m == pytest.approx(-dy, abs=0.006)
    assert behind_m == pytest.approx(down * dx, abs=0.006)


def test_a_hint_is_in_words_and_none_where_nothing_is_found():
    left = picture(box(1, 0.7, -0.17), BOXES[1])
    assert "cm too far left" in hint(REFERENCE, left, 1)
    nearer = picture(box(1, 0.66, -0.2), BOXES[1])
    assert hint(REFERENCE, nearer, 1).endswith("cm too near")
    assert hint(REFERENCE, picture(BOXES[1]), 1) == ""
    assert shift_m(REFERENCE, SEEN, 1) is None  # no place is better
    assert shift_m(REFERENCE, SEEN, 9) is None
