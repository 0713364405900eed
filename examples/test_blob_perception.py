"""The example perception keeps to the rules, and finds what stands apart."""

import numpy as np

from blob_perception import Blobs
from torc import Wanted
from torc.protocols import TARGET_ID
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import SyntheticBox, synthetic_capture, synthetic_observation

APART = tuple(SyntheticBox(k, (0.62, -0.30 + 0.2 * k, 1.10), (0.05, 0.05, 0.10)) for k in range(3))


def test_it_conforms():
    check_perception(Blobs)


def test_things_that_stand_apart_are_objects_and_keep_their_ids():
    observation = synthetic_observation(APART)
    scene = Blobs().perceive(observation, Wanted("the box"), None)
    assert len(scene.objects) == 3
    for shape in APART:
        at = [np.linalg.norm(o.points.mean(axis=0)[:2] - shape.center[:2]) for o in scene.objects]
        assert min(at) < 0.04
    later = Blobs().perceive(synthetic_observation(APART[1:]), Wanted("the box"), scene)
    kept = {o.id: o.points.mean(axis=0) for o in scene.objects}
    for o in later.objects:
        assert np.linalg.norm(kept[o.id] - o.points.mean(axis=0)) < 0.01


def test_the_target_is_found_by_its_color():
    capture = synthetic_capture(APART)
    observation, second = capture.observation, capture.label_image == 1
    observation.rgb[second] = (30, 60, 200)
    scene = Blobs().perceive(observation, Wanted("the blue box"), None)
    assert scene.target_id == TARGET_ID
    assert np.abs(scene.object(TARGET_ID).points.mean(axis=0)[1] - APART[1].center[1]) < 0.03
    assert Blobs().perceive(observation, Wanted("the box"), None).target_id is None
