"""Crops hold all objects and keep the aspect; strips hold all picks."""

import numpy as np
import pytest

from torc.episode.pictures import Frame, crop_around_objects, picture_strip
from torc.records import PickOutcome, PickResult


@pytest.mark.parametrize(
    "box", [(10, 20, 30, 40), (0, 480, 0, 640), (470, 480, 630, 640), (200, 203, 5, 600)]
)
def test_crop_holds_all_objects_in_the_images_own_aspect(box):
    labels = np.full((480, 640), -1, np.int16)
    labels[box[0] : box[1], box[2] : box[3]] = 3
    part = labels[crop_around_objects(labels)]
    assert np.count_nonzero(part == 3) == np.count_nonzero(labels == 3)
    assert part.shape[1] / part.shape[0] == pytest.approx(640 / 480, rel=0.03)


@pytest.mark.parametrize("picks", [1, 4, 5, 9])
def test_strip_holds_every_pick(picks, rng):
    image = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
    done = PickOutcome(PickResult.REMOVED, 1)
    frames = [
        Frame(i, image, None if i == 2 else i, "because " * 40, done if i else None) for i in range(picks)
    ]
    strip = picture_strip(frames)
    assert strip.shape[1] == 480 * min(picks, 4)
    assert strip.shape[0] == (480 * 48 // 64 + 92) * -(-picks // 4)
