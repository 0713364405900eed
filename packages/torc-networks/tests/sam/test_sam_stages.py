"""The stages grounded-sam2 and sam3 as a whole, with tiny networks: what random weights find is anything, anywhere."""

from dataclasses import replace

import numpy as np
import pytest

from torc.perception.protocol import Wanted
from torc.perception.target import Certainty
from torc.records import MAX_OBJECTS
from torc.testing.contexts import box
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import synthetic_observation

WHAT = "the red box"
WORDS = Wanted(WHAT)
SHAPES = (box(1, 0.60, -0.20, (0.06, 0.06, 0.10)), box(2, 0.62, 0.00, (0.05, 0.08, 0.08)))


@pytest.fixture(params=["grounded", "concepts"])
def make(request):
    return request.getfixturevalue(request.param)


@pytest.mark.long
def test_they_keep_the_rules_of_perceptions(make):
    check_perception(make)


def test_objects_have_clouds_and_the_picture_may_have_any_size(make):
    observation = synthetic_observation(SHAPES)
    K = observation.K.copy()
    K[1, 2] -= 40
    cut = slice(40, 441, None), slice(0, 601, None)  # odd sizes
    other = replace(
        observation,
        rgb=np.ascontiguousarray(observation.rgb[cut]),
        depth_m=np.ascontiguousarray(observation.depth_m[cut]),
        K=K,
    )
    for snapshot in (observation, other):
        scene = make().perceive(snapshot, WORDS, None)
        assert scene.label_image.shape == snapshot.depth_m.shape
        assert 0 < len(scene.objects) < MAX_OBJECTS
        assert all(len(o.points) == len(o.normals) > 0 for o in scene.objects)


def test_an_episode_keeps_ids_where_nothing_moves(make):
    eyes = make()
    observation = synthetic_observation(SHAPES)
    first = eyes.perceive(observation, WORDS, None)
    second = eyes.perceive(observation, WORDS, first)
    assert np.array_equal(first.label_image, second.label_image)
    assert all(k.looks == 2 for k in second.known)


def test_what_is_not_asked_for_is_not_the_target(make):
    observation = synthetic_observation(SHAPES)
    assert make().perceive(observation, Wanted(""), None).target_id is None
    assert make(words=Certainty(1.0, 0.0, 0.0)).perceive(observation, WORDS, None).target_id is None


def test_scores_that_no_mask_reaches_leave_an_empty_scene(make):
    scene = make(object_score=1.0, words=Certainty(1.0, 0.0, 0.0)).perceive(
        synthetic_observation(SHAPES), WORDS, None
    )
    assert scene.objects == ()
    assert len(scene.background_points) > 0


def test_two_calls_read_each_phrase_alone_and_one_call_reads_both(grounded, dino, rgb, monkeypatch):
    texts = []
    process = type(dino.processor).__call__

    def noting(self, *args, **kwargs):
        texts.append(kwargs["text"])
        return process(self, *args, **kwargs)

    monkeypatch.setattr(type(dino.processor), "__call__", noting)
    low = {"object_score": 0.0, "words": Certainty(0.0, 0.0, 0.0)}
    corners, scores, wanted_p = grounded(**low).boxes(rgb, WHAT)
    assert texts == ["object.", f"{WHAT}."]
    assert len(corners) == 40
    assert np.count_nonzero(wanted_p) == 20
    assert (np.diff(scores) <= 0).all()
    texts.clear()
    corners, scores, wanted_p = grounded(**low, one_call=True).boxes(rgb, WHAT)
    assert texts == [f"object. {WHAT}."]
    assert len(corners) == 20
    assert (scores >= wanted_p).all()
    assert (wanted_p > 0).all()
    texts.clear()
    corners, _, wanted_p = grounded(**low, one_call=True).boxes(rgb, "")
    assert texts == ["object."]
    assert (wanted_p == 0).all()


def test_sam3s_objects_are_the_target_only_where_the_description_finds_them(concepts, rgb):
    every = {"object_score": 0.0, "words": Certainty(0.0, 0.0, 0.0)}
    anything = concepts(**every).propose(rgb, "")
    assert len(anything.scores) == 12
    assert (anything.wanted_p == 0).all()
    both = concepts(**every).propose(rgb, "red box")
    found = both.wanted_p > 0
    assert np.count_nonzero(found) == np.count_nonzero(~found) == 12
    assert (both.wanted_p[found] == both.scores[found]).all()
    assert (np.diff(both.scores) <= 0).all()
    assert len(concepts(**every, most=5).propose(rgb, "red box").scores) == 5


def test_boxes_below_their_threshold_do_not_count_and_the_surest_come_first(grounded, rgb):
    every = grounded(object_score=0.0, words=Certainty(0.0, 0.0, 0.0)).boxes(rgb, WHAT)
    corners, scores, wanted_p = grounded(object_score=0.9, words=Certainty(0.95, 0.0, 0.0)).boxes(rgb, WHAT)
    assert 0 < len(corners) < len(every[0])
    objects = wanted_p == 0
    assert (scores[objects] >= 0.9).all()
    assert (wanted_p[~objects] >= 0.95).all()
    assert np.array_equal(grounded(most=3).boxes(rgb, WHAT)[1], grounded().boxes(rgb, WHAT)[1][:3])


def test_an_overlap_that_is_no_number_is_no_object(grounded, sam2, monkeypatch):
    def broken(**given):
        out = forward(**given)
        out.iou_scores[:] = float("nan")
        return out

    forward = sam2.model.forward
    monkeypatch.setattr(sam2.model, "forward", broken)
    scene = grounded().perceive(synthetic_observation(SHAPES), WORDS, None)
    assert scene.objects == ()
