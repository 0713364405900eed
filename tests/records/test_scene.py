"""What is told of a scene afterwards: which object is the target, and what was brought."""

from dataclasses import replace

import numpy as np
import pytest

from torc.records import KnownObject
from torc.testing.contexts import see
from torc.testing.synthetic import random_clutter, synthetic_capture


@pytest.fixture
def scene(rng):
    return see(synthetic_capture(random_clutter(rng, 5)))


def test_the_named_object_and_the_target_change_ids(scene):
    named = scene.ids[-1]
    other = scene.with_target(named)
    np.testing.assert_array_equal(other.label_image == 0, scene.label_image == named)
    np.testing.assert_array_equal(other.label_image == named, scene.label_image == 0)
    np.testing.assert_array_equal(other.object(0).points, scene.object(named).points)
    assert list(other.ids) == sorted(other.ids)
    assert other.target_id == 0
    again = other.with_target(named)
    np.testing.assert_array_equal(again.label_image, scene.label_image)


def test_what_is_not_in_sight_is_not_named(scene):
    with pytest.raises(KeyError):
        scene.with_target(63)


def test_what_was_brought_leaves_the_others_their_shares(scene, rng):
    """By Bayes' rule: what is left shares what the brought object does not have, as it did before."""
    odds = {k: float(o) for k, o in zip(scene.ids, rng.lognormal(0, 2, len(scene.ids)), strict=True)}
    brought, look = 0.0, np.array([1, 0], np.float32)
    for object_id, p_in_hand in ((scene.ids[1], 0.7), (scene.ids[-1], 0.05)):
        total = 1 + brought + sum(odds.values())
        p = {k: o / total for k, o in odds.items()}
        points = scene.object(object_id).points
        known = tuple(KnownObject(k, points, look, 1.0, target_p=v) for k, v in p.items())
        # An object that is out of sight has no share.
        known += (KnownObject(60, points, look, 1.0, target_p=0.9),)
        seen = replace(scene, known=known, brought_odds=brought)
        seen = replace(seen, objects=tuple(o for o in scene.objects if o.id in odds))
        brought = seen.with_brought(object_id, p_in_hand).brought_odds
        del odds[object_id]
        after = {k: o / (1 + brought + sum(odds.values())) for k, o in odds.items()}
        left = (1 - p_in_hand) / (1 - p[object_id])
        assert after == pytest.approx({k: p[k] * left for k in odds})
