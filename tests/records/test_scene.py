"""What is told of a scene afterwards: which object is the target, and what was brought."""

from dataclasses import replace

import numpy as np
import pytest

from torc.records import TARGET_ID, KnownObject
from torc.testing.contexts import see
from torc.testing.synthetic import random_clutter, synthetic_capture


@pytest.fixture
def scene(rng):
    return see(synthetic_capture(random_clutter(rng, 5)))


def known(*ids, target=None):
    look = np.ones(3, np.float32)
    return tuple(KnownObject(k, np.zeros((1, 3), np.float32), look, 1.0, is_target=k == target) for k in ids)


def test_another_target_changes_no_id(scene):
    other = scene.with_target(scene.ids[-1])
    assert other.target_id == other.target_number == scene.ids[-1]
    assert other.ids == scene.ids
    assert other.label_image is scene.label_image
    assert other.with_target(scene.target_id).target_id == scene.target_id


def test_a_target_that_was_seen_keeps_its_number_out_of_sight(scene):
    """Until another object is the target; and whoever was never seen is number 0."""
    first, second = scene.ids[-2:]
    seen = replace(scene, known=known(*scene.ids)).with_target(first)
    assert [k.id for k in seen.known if k.is_target] == [first]
    gone = tuple(o for o in seen.objects if o.id != first)
    hidden = replace(seen, objects=gone).with_target(None)
    assert (hidden.target_id, hidden.target_number) == (None, first)
    other = hidden.with_target(second)
    assert other.target_number == second
    assert first not in {k.id for k in other.known}
    assert seen.with_target(None).target_number == TARGET_ID


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
