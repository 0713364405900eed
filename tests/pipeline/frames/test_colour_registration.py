"""A colour picture that is not registered to the depth is told from one that is."""

import cv2
import numpy as np
import pytest

from torc.brain import load_frame
from torc.pipeline.frames.registration import registration_doubt


@pytest.fixture(scope="module")
def seen():
    return load_frame("examples/frame.npz").observation


def zoomed(rgb, scale):
    h, w = rgb.shape[:2]
    M = np.array([[scale, 0, (1 - scale) * w / 2], [0, scale, (1 - scale) * h / 2]])
    return cv2.warpAffine(rgb, M, (w, h), borderMode=cv2.BORDER_REPLICATE)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda rgb: np.roll(rgb, 40, axis=1),
        lambda rgb: np.roll(rgb, -30, axis=0),
        lambda rgb: np.ascontiguousarray(rgb[:, ::-1]),
        lambda rgb: np.ascontiguousarray(rgb[::-1, ::-1]),
        lambda rgb: zoomed(rgb, 1.3),
    ],
)
def test_edges_that_meet_elsewhere(seen, spoil):
    assert "not registered" in registration_doubt(spoil(seen.rgb), seen.depth_m)


def test_a_good_picture_and_one_without_edges_say_nothing(seen, rng):
    assert registration_doubt(seen.rgb, seen.depth_m) == ""
    assert registration_doubt(np.full_like(seen.rgb, 90), seen.depth_m) == ""
    noise = rng.integers(0, 255, seen.rgb.shape, dtype=np.uint8)
    assert registration_doubt(noise, seen.depth_m) == ""
    assert registration_doubt(seen.rgb, np.zeros_like(seen.depth_m)) == ""
