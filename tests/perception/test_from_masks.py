"""What torc makes of masks for anybody who finds some."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import PartError
from torc.perception.checked_scenes import ask_recognition
from torc.perception.from_masks import FromMasks, Masks
from torc.perception.protocol import Wanted
from torc.pipeline.building import make_stage
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import synthetic_capture, synthetic_observation


class Halves(FromMasks):
    """One mask per half of the picture, of what is not far away: no more is needed for a perception of one's own."""

    def find(self, observation, wanted):
        near = (observation.depth_m > 0) & (observation.depth_m < 0.75)
        right = np.arange(near.shape[1]) >= near.shape[1] // 2
        label = np.where(near, right.astype(np.int16), np.int16(-1))
        return Masks(label, np.array([0.5, 0.6], np.float32))


def test_masks_are_enough_for_a_perception():
    check_perception(Halves)


def test_one_of_ones_own_is_made_by_its_name_with_its_settings():
    spec = PipelineSpec(perception=f"{__name__}:Halves", settings={"perception.clouds.min_pixels": 99})
    part = make_stage(spec, "perception", rough=True)
    assert part.config.clouds.min_pixels == 99
    assert part.config.clouds.edge_slope == 4.0
    observation = synthetic_observation(
        (box(1, 0.55, -0.20, (0.1, 0.1, 0.2)), box(2, 0.55, 0.0, (0.1, 0.1, 0.2)))
    )
    scene = part.perceive(observation, Wanted("the left half"), None)
    assert len(scene.objects) == 2
    assert scene.target_id is None
    assert sorted(k.sureness for k in scene.known) == [np.float32(0.5), np.float32(0.6)]


def test_what_is_in_the_hand_is_judged_by_pictures_and_else_by_what_was_believed(rng):
    """A picture of the object itself tells more than one of something else."""
    eyes = Halves()
    observation = synthetic_observation((box(1, 0.55, -0.20, (0.1, 0.1, 0.2)),))
    own = np.dstack([rng.integers(0, 255, (40, 30, 3)), np.full((40, 30), 255)]).astype(np.uint8)
    own[0, :, 3] = 0
    other = np.where(np.arange(4) < 3, np.uint8(120), own)
    rgb, mask = observation.rgb.copy(), np.zeros(observation.depth_m.shape, bool)
    rgb[101:140, 200:230], mask[101:140, 200:230] = own[1:, :, :3], True
    seen, scene = replace(observation, rgb=rgb), eyes.perceive(observation, Wanted("", (own,)), None)
    before = scene.known[0]

    def recognised(where, *pictures, size_m=None):
        return ask_recognition(eyes, seen, where, Wanted("", pictures, size_m=size_m), scene, before.id)

    assert recognised(mask, own) > recognised(mask, other)
    assert recognised(np.zeros_like(mask), own) == before.target_p > 0
    assert recognised(mask) is None
    # The same once more in sight may be the target as well.
    likely, looked_at = replace(before, target_p=0.3), scene
    scene = replace(scene, known=(likely,))
    alone = recognised(mask, own)
    scene = replace(scene, known=(likely, replace(likely, id=before.id + 100)))
    assert 1 / recognised(mask, own) > 1 / alone + 0.8
    scene = looked_at
    # Of something larger one may see so little; of something smaller, never so much.
    there = eyes.size_in_hand(seen, mask)
    smaller, larger = (tuple(k * e for e in there) for k in (0.7, 1.5))
    assert recognised(mask, own, size_m=larger) == recognised(mask, own)
    assert recognised(mask, own, size_m=smaller) < 0.01
    unread = replace(seen, depth_m=np.where(mask, np.float32(0), seen.depth_m))
    assert ask_recognition(
        eyes, unread, mask, Wanted("", (own,), size_m=smaller), scene, before.id
    ) == recognised(mask, own)


def test_of_two_alike_the_size_tells_which_it_is():
    boxes = box(1, 0.55, -0.20, (0.1, 0.1, 0.25)), box(2, 0.55, 0.0, (0.05, 0.05, 0.08))
    observation = synthetic_observation(boxes)
    picture = np.full((30, 30, 3), 128, np.uint8)

    def odds_of_the_short_one(size_m):
        scene = Halves().perceive(observation, Wanted("", (picture,), size_m=size_m), None)
        by_place = sorted(scene.known, key=lambda k: k.points[:, 1].mean())
        return by_place[1].target_p / by_place[0].target_p

    # The halves are .54 and .64 m long, with the table in them.
    assert odds_of_the_short_one((0.54, 0.5)) > 1.4 * odds_of_the_short_one(None)
    assert odds_of_the_short_one((1.5, 1.5)) == pytest.approx(odds_of_the_short_one(None))


def test_what_may_be_in_the_bin_is_remembered_from_look_to_look():
    observation, eyes = synthetic_observation((box(1, 0.55, -0.20, (0.1, 0.1, 0.25)),)), Halves()
    wanted = Wanted("", (np.full((30, 30, 3), 128, np.uint8),))
    scene = eyes.perceive(observation, wanted, None)
    again = eyes.perceive(observation, wanted, replace(scene, brought_odds=3.0))
    assert again.brought_odds == 3.0
    before, after = ([k.target_p for k in s.known] for s in (scene, again))
    none = 1 - sum(before)
    assert after == pytest.approx([p / (1 + 3.0 * none) for p in before])


class TooHigh(FromMasks):
    """The true masks, two pixels more at their upper edge."""

    def find(self, observation, wanted):
        label = np.full(observation.depth_m.shape, -1, np.int16)
        for k in np.unique(self.truth[self.truth >= 0]):
            mask = self.truth == k
            label[mask | np.roll(mask, -1, axis=0) | np.roll(mask, -2, axis=0)] = k
        return Masks(label, np.ones(label.max() + 1, np.float32))


def test_a_mask_that_reaches_beyond_its_object_makes_it_no_larger():
    """With exact depth too: a strip of table or wall behind it, taken for a part, would make it a metre wide."""
    shapes = (box(0, 0.55, -0.20, (0.1, 0.1, 0.2)), box(1, 0.55, 0.0, (0.1, 0.1, 0.2)))
    capture, eyes = synthetic_capture(shapes), TooHigh()
    eyes.truth = capture.label_image
    scene = eyes.perceive(capture.observation, Wanted(""), None)
    assert len(scene.objects) == 2
    for o in scene.objects:
        assert np.all(np.ptp(o.points, axis=0) < 0.22)


def test_a_recognition_that_is_no_probability_is_refused():
    eyes = Halves()
    eyes.recognise = lambda *_: 1.2
    observation = synthetic_observation((box(1, 0.55, -0.20, (0.1, 0.1, 0.2)),))
    with pytest.raises(PartError, match="no probability"):
        ask_recognition(eyes, observation, np.zeros((1, 1), bool), Wanted(""), None, 1)


class Wrong(Halves):
    def __init__(self, masks):
        self.masks = masks  # and no super().__init__()

    def find(self, observation, wanted):
        return self.masks


@pytest.mark.parametrize(
    ("masks", "text"),
    [
        (np.zeros((4, 4)), "returned a ndarray, not Masks"),
        (
            Masks(np.zeros((60, 80), np.int16), np.ones(1, np.float32)),
            r"label is \(60, 80\) int16; it must be",
        ),
        (
            Masks(np.full((240, 320), 2, np.int16), np.ones(1, np.float32)),
            r"sureness is \(1,\).*label numbers 3 masks",
        ),
        (Masks(np.full((240, 320), -2, np.int16), np.ones(1, np.float32)), "label has -2; it is -1 where"),
    ],
)
def test_unusable_masks_are_blamed_on_who_found_them(masks, text):
    observation = synthetic_observation((box(1, 0.55, -0.20, (0.1, 0.1, 0.2)),))
    if isinstance(masks, Masks) and masks.label.shape == (240, 320):
        masks = replace(masks, label=np.resize(masks.label, observation.depth_m.shape))
    with pytest.raises(PartError, match=rf"Wrong.find \(.*test_from_masks\.py, line \d+\): .*{text}"):
        Wrong(masks).perceive(observation, Wanted(""), None)
