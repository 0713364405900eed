"""Laws of choosing which grasps to hand on."""

import numpy as np
import pytest

from torc.geometry.transforms import rotation_from_rpy
from torc.grasping.config import SelectionConfig
from torc.grasping.selection import chosen, thinned

CONFIG = SelectionConfig(max_per_object=12, min_blocked_share=0.25)


@pytest.fixture
def grasps(rng):
    n = 400
    Rs = np.array([rotation_from_rpy(rng.uniform(-0.6, 0.6, 3)) for _ in range(n)])
    return rng.random(n), rng.random(n) < 0.4, Rs, rng.uniform(0, 0.05, (n, 3))


def alike(a, b, Rs, tips):
    angle = np.cos(CONFIG.angle_rad)
    return (
        np.linalg.norm(tips[a] - tips[b]) <= CONFIG.position_m
        and abs(Rs[a, :, 0] @ Rs[b, :, 0]) > angle
        and Rs[a, :, 2] @ Rs[b, :, 2] > angle
    )


def test_no_two_of_a_kind_are_alike_and_every_dropped_one_has_a_better_twin(grasps):
    scores, blocked, Rs, tips = grasps
    config = SelectionConfig(max_per_object=1000)
    kept = thinned(scores, blocked, Rs, tips, config)
    for kind in (False, True):
        same = [i for i in kept if blocked[i] == kind]
        assert not any(alike(a, b, Rs, tips) for a in same for b in same if a != b)
        for i in np.flatnonzero(blocked == kind):
            if i not in same:
                assert any(alike(i, k, Rs, tips) and scores[k] >= scores[i] for k in same)


def test_the_best_of_each_kind_is_always_chosen_and_the_order_falls(grasps):
    scores, blocked, Rs, tips = grasps
    best = chosen(thinned(scores, blocked, Rs, tips, CONFIG), scores, blocked, CONFIG)
    assert len(best) == 12
    assert np.all(np.diff(scores[best]) <= 0)
    assert np.count_nonzero(blocked[best]) == 3
    for kind in (False, True):
        index = np.flatnonzero(blocked == kind)
        assert index[np.argmax(scores[index])] in best


@pytest.mark.parametrize("kind", [False, True])
def test_unused_places_go_to_the_other_kind(grasps, kind):
    scores, _, Rs, tips = grasps
    blocked = np.full(len(scores), kind)
    assert len(chosen(thinned(scores, blocked, Rs, tips, CONFIG), scores, blocked, CONFIG)) == 12


def test_half_a_turn_about_the_approach_is_the_same_grasp(rng):
    R = rotation_from_rpy((0.1, 2.9, 0.3))
    Rs = np.array([R, R @ np.diag([-1.0, -1.0, 1.0])])
    kept = thinned(np.array([0.4, 0.5]), np.zeros(2, dtype=bool), Rs, np.zeros((2, 3)), CONFIG)
    assert kept.tolist() == [1]
