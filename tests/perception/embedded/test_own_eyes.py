"""torc's own eyes on analytic scenes: what they were never trained on, with exact depth."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.embedded.perception import EmbeddedPerception
from torc.perception.protocol import Wanted
from torc.perception.scoring import mean_score, score_masks
from torc.records import MAX_OBJECTS
from torc.testing.contexts import box
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import random_clutter, synthetic_capture

NOTHING = Wanted("")
A = box(1, 0.60, -0.20, (0.06, 0.06, 0.10))
B = box(2, 0.62, 0.00, (0.05, 0.08, 0.08))
C = box(3, 0.75, -0.10, (0.06, 0.06, 0.16))


def blind(shapes):
    """What a camera sees, and the labels that it does not know."""
    capture = synthetic_capture(shapes)
    return capture.observation, capture.label_image


def test_they_keep_the_rules_of_perceptions():
    check_perception(EmbeddedPerception)


def test_they_find_most_of_what_they_never_saw():
    scores = []
    for seed in range(4):
        observation, truth = blind(random_clutter(np.random.default_rng(seed), 10))
        label, _ = EmbeddedPerception().masks(observation)
        scores.append(score_masks(label, np.where(truth >= 0, truth, -1).astype(np.int16)))
    assert mean_score(scores).overlap_f > 0.8


def test_the_number_of_threads_changes_nothing(monkeypatch):
    observation, _ = blind(random_clutter(np.random.default_rng(5), 10))
    found = []
    for threads in ("1", "2", "7"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        found.append(EmbeddedPerception().perceive(observation, NOTHING, None))
    for scene in found[1:]:
        assert np.array_equal(scene.label_image, found[0].label_image)
        for o, k, first, known in zip(
            scene.objects, scene.known, found[0].objects, found[0].known, strict=True
        ):
            assert np.array_equal(o.points, first.points)
            assert np.array_equal(o.normals, first.normals)
            assert np.array_equal(k.look, known.look)


def test_an_empty_table_is_an_empty_scene():
    scene = EmbeddedPerception().perceive(blind(())[0], NOTHING, None)
    assert scene.objects == ()
    assert scene.target_id is None
    assert len(scene.background_points)


def test_the_whole_scene_turned_upside_down_in_the_picture_is_the_same_scene():
    observation, _ = blind((A, B, C))
    h, w = observation.depth_m.shape
    K, T = observation.K.copy(), observation.T_world_camera.copy()
    K[0, 2], K[1, 2] = w - 1 - K[0, 2], h - 1 - K[1, 2]
    T[:3, :3] = T[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    flipped = replace(
        observation,
        rgb=np.ascontiguousarray(observation.rgb[::-1, ::-1]),
        depth_m=np.ascontiguousarray(observation.depth_m[::-1, ::-1]),
        K=K,
        T_world_camera=T,
    )
    eyes = EmbeddedPerception()
    upright, turned = eyes.masks(observation)[0], eyes.masks(flipped)[0]
    assert score_masks(turned[::-1, ::-1].copy(), upright).overlap_f > 0.97


def test_ids_stay_through_a_short_episode():
    eyes = EmbeddedPerception()
    first = eyes.perceive(blind((A, B, C))[0], NOTHING, None)
    second = eyes.perceive(blind((A, C))[0], NOTHING, first)
    middles = {o.id: o.points.mean(axis=0) for o in first.objects}
    for o in second.objects:
        assert np.linalg.norm(middles[o.id] - o.points.mean(axis=0)) < 0.02
    assert len(second.objects) == len(first.objects) - 1


def at(label, k):
    """A pixel (column, row) of an object."""
    rows, cols = np.nonzero(label == k)
    middle = int(np.argmin((rows - rows.mean()) ** 2 + (cols - cols.mean()) ** 2))
    return int(cols[middle]), int(rows[middle])


def test_a_mark_or_a_box_says_which_is_the_target_and_it_stays_that():
    observation, truth = blind((A, B, C))
    rows, cols = np.nonzero(truth == 2)
    frame = (int(cols.min()), int(rows.min()), int(cols.max()) + 1, int(rows.max()) + 1)
    for mark in (at(truth, 2), frame):
        eyes = EmbeddedPerception()
        scene = eyes.perceive(observation, Wanted("", mark=mark), None)
        target = scene.target_id
        assert truth[scene.label_image == target].mean() > 1.8
        later = eyes.perceive(blind((B, C))[0], Wanted("", mark=mark), scene)
        assert later.target_id == target
        assert np.abs(later.object(target).points - scene.object(target).points.mean(0)).max() < 0.12


def test_a_mark_on_nothing_is_no_target_and_one_off_the_picture_is_refused():
    observation, _ = blind((A, B))
    assert EmbeddedPerception().perceive(observation, Wanted("", mark=(5, 470)), None).target_id is None
    with pytest.raises(InputError, match="off the picture"):
        EmbeddedPerception().perceive(observation, Wanted("", mark=(5000, 4)), None)
    with pytest.raises(InputError, match="mark is"):
        Wanted("", mark=(1, 2, 3))
    with pytest.raises(InputError, match="no area"):
        Wanted("", mark=(5, 5, 5, 9))


def test_two_hundred_objects_are_sixty_three_at_most():
    shapes = tuple(
        box(1 + i % 60, 0.45 + 0.04 * (i // 14), -0.55 + 0.066 * (i % 14), (0.025, 0.035, 0.05))
        for i in range(196)
    )
    scene = EmbeddedPerception().perceive(blind(shapes)[0], NOTHING, None)
    assert 20 < len(scene.objects) < MAX_OBJECTS
