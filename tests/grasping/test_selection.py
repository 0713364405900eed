"""Laws of choosing which grasps to hand on."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import make_pose
from torc.grasping.config import SelectionConfig
from torc.grasping.selection import chosen, thinned

CONFIG = SelectionConfig(max_per_object=12, min_blocked_share=0.25)


@pytest.fixture
def grasps(rng):
    n = 400
    Rs = [Rotation.from_euler("xyz", rng.uniform(-0.6, 0.6, 3)).as_matrix() for _ in range(n)]
    poses = [make_pose(R, rng.uniform(0, 0.05, 3)) for R in Rs]
    return rng.random(n), rng.random(n) < 0.4, np.array(poses)


def alike(a, b):
    cosines = np.einsum("ij,ij->j", a[:3], b[:3])
    close = np.linalg.norm(a[:3, 3] - b[:3, 3]) <= CONFIG.position_m
    return close and min(abs(cosines[0]), cosines[2]) > np.cos(CONFIG.angle_rad)


def test_no_two_of_a_kind_are_alike_and_every_dropped_one_has_a_better_one(grasps):
    scores, blocked, Ts = grasps
    config = SelectionConfig(max_per_object=1000)
    kept = thinned(scores, blocked, Ts, config)
    for kind in (False, True):
        same = [i for i in kept if blocked[i] == kind]
        assert not any(alike(Ts[a], Ts[b]) for a in same for b in same if a != b)
        for i in np.flatnonzero(blocked == kind):
            if i not in same:
                assert any(alike(Ts[i], Ts[k]) and scores[k] >= scores[i] for k in same)


def test_the_best_of_each_kind_is_always_chosen_and_the_order_falls(grasps):
    scores, blocked, Ts = grasps
    best = chosen(thinned(scores, blocked, Ts, CONFIG), scores, blocked, CONFIG)
    assert len(best) == 12
    assert np.all(np.diff(scores[best]) <= 0)
    assert np.count_nonzero(blocked[best]) == 3
    for kind in (False, True):
        index = np.flatnonzero(blocked == kind)
        assert index[np.argmax(scores[index])] in best


@pytest.mark.parametrize("kind", [False, True])
def test_unused_places_go_to_the_other_kind(grasps, kind):
    scores, _, Ts = grasps
    blocked = np.full(len(scores), kind)
    assert len(chosen(thinned(scores, blocked, Ts, CONFIG), scores, blocked, CONFIG)) == 12


def test_half_a_turn_about_the_approach_is_the_same_grasp(rng):
    R = Rotation.from_euler("xyz", (0.1, 2.9, 0.3)).as_matrix()
    Ts = np.array([make_pose(R, np.zeros(3)), make_pose(R @ np.diag([-1.0, -1.0, 1.0]), np.zeros(3))])
    kept = thinned(np.array([0.4, 0.5]), np.zeros(2, dtype=bool), Ts, CONFIG)
    assert kept.tolist() == [1]
