"""Colour of another camera than the depth's is noticed; that of the same camera is not doubted."""

import numpy as np
import pytest
from frame_makers import arrays, box, npz

from torc.geometry.transforms import look_at, make_pose
from torc.perception.noise import add_sensor_noise, stereo_camera
from torc.pipeline.frames import load_frame
from torc.pipeline.frames.registration import registration_doubt
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import CameraMount

POSE = look_at((0.25, 0.1, 1.55), (0.68, -0.05, 1.05))
SHAPES = (
    box(0, 0.62, 0.0, (0.06, 0.06, 0.10)),
    box(1, 0.60, -0.2, (0.08, 0.06, 0.12)),
    box(2, 0.72, -0.1, (0.05, 0.05, 0.16)),
    box(3, 0.75, 0.1, (0.07, 0.09, 0.08)),
    box(4, 0.5, -0.07, (0.05, 0.08, 0.06)),
)


def seen(right_m=0.0, fov_rad=0.9):
    pose = POSE @ make_pose(np.eye(3), [right_m, 0.0, 0.0])
    return synthetic_capture(SHAPES, CameraMount(pose, 320, 240, fov_rad))


SEEN = seen()
DEPTH = SEEN.observation
OTHERS = {
    "beside": seen(0.06).observation,
    "narrower": seen(0.015, 0.65).observation,
    "wider": seen(-0.02, 1.1).observation,
}


@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("which", list(OTHERS))
def test_colour_of_another_camera_is_noticed(which, noisy, rng):
    o = add_sensor_noise(SEEN, stereo_camera(), rng).observation if noisy else DEPTH
    assert "not seem to be registered" in registration_doubt(OTHERS[which].rgb, o.depth_m)
    assert registration_doubt(o.rgb, o.depth_m) == ""


def test_the_message_says_where_the_edges_would_meet():
    """The colour's camera is to the right, so things are to the left in its picture, by 311 px x 6 cm / .65 m."""
    text = registration_doubt(OTHERS["beside"].rgb, DEPTH.depth_m)
    px, words = text.split("shifted by about ")[1].split(" pixels ")
    assert 22 < int(px) < 38
    assert words.startswith("to the left and ")


def test_pictures_without_edges_or_of_odd_shapes_are_not_doubted(rng):
    h, w = DEPTH.depth_m.shape
    grey = np.full_like(DEPTH.rgb, 90)
    speckle = rng.integers(0, 255, DEPTH.rgb.shape, dtype=np.uint8)
    flat = np.full((h, w), 0.8, np.float32)
    lone = np.zeros((h, w), np.float32)
    lone[1, 1] = 0.5
    for rgb, depth in ((grey, DEPTH.depth_m), (speckle, DEPTH.depth_m), (DEPTH.rgb, flat), (DEPTH.rgb, lone)):
        assert registration_doubt(rgb, depth) == ""
    assert registration_doubt(DEPTH.rgb[:20], DEPTH.depth_m[:20]) == ""
    assert registration_doubt(DEPTH.rgb[:, :20], DEPTH.depth_m[:, :20]) == ""


def test_a_frame_says_so(tmp_path):
    path = npz(tmp_path, **arrays(SEEN) | {"rgb": OTHERS["narrower"].rgb})
    (message,) = load_frame(path).warnings
    assert "not seem to be registered" in message
