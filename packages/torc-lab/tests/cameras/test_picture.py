"""The picture of a snapshot: everything is where it belongs, and what was not seen is hatched."""

from dataclasses import replace

import numpy as np
from camera_scenes import COLOR, POSE, captured

from torc.drawing.marking import mark_image
from torc.testing.contexts import see
from torc_lab.cameras.picture import depth_colors, snapshot_picture

CAPTURE = captured(COLOR, POSE)
SEEN = CAPTURE.observation
W, GAP = COLOR.width, 6


def test_colour_depth_and_masks_stand_side_by_side():
    scene = see(CAPTURE)
    picture = snapshot_picture(SEEN, scene)
    assert picture.shape == (COLOR.height, 3 * W + 2 * GAP, 3)
    np.testing.assert_array_equal(picture[:, :W], SEEN.rgb)
    np.testing.assert_array_equal(picture[:, W + GAP : 2 * W + GAP], depth_colors(SEEN.depth_m))
    np.testing.assert_array_equal(picture[:, 2 * (W + GAP) :], mark_image(scene))
    assert snapshot_picture(SEEN, scene, max_width_px=500).shape[1] == 500


def test_what_was_not_seen_is_hatched_in_depth_and_masks():
    depth = SEEN.depth_m.copy()
    depth[50:100, 100:200] = 0
    picture = snapshot_picture(replace(SEEN, depth_m=depth)).astype(int)
    whole = snapshot_picture(SEEN).astype(int)
    changed = (picture != whole).any(axis=2)
    assert not changed[:, :W].any()
    assert changed[60:90, W + GAP + 110 : W + GAP + 190].mean() > 0.9
    masks = changed[:, 2 * (W + GAP) :]
    assert masks[50:100, 100:200].mean() > 0.9
    assert masks.sum() <= 50 * 100


def test_near_is_red_and_far_is_blue():
    ramp = np.tile(np.linspace(0.5, 3, 200, dtype=np.float32), (20, 1))
    colors = depth_colors(ramp).astype(int)
    assert colors[0, 20, 0] > colors[0, 20, 2] + 80
    assert colors[0, 180, 2] > colors[0, 180, 0] + 80
    # A far wall takes no colour from the rest.
    np.testing.assert_array_equal(
        depth_colors(np.where(ramp > 2.9, 90, ramp).astype(np.float32))[:, :150], colors[:, :150]
    )
    assert depth_colors(np.zeros((4, 4), np.float32)).max() == 0
