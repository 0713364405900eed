"""The search finds free paths, never draws from anywhere but the generator, and gives up when told."""

from itertools import pairwise

import numpy as np
import pytest

from torc.collision.contacts import robot_arrays
from torc.motion.config import MotionConfig, SearchConfig
from torc.motion.search import corner_blends, shortcut, tree_search
from torc.motion.space import MotionQuery, free_space, grown
from torc.motion.timed_motions import free_path, timed_motion
from torc.records import PlanStage


@pytest.fixture(scope="module")
def space(robot, request_for):
    arm = robot.arm
    return free_space(
        robot_arrays(robot), request_for(0)[0].world, 0.085, (arm.lower, arm.upper), arm.max_speed
    )


@pytest.fixture(scope="module")
def queries(robot, space):
    """Pairs of free configurations, both near the clutter, without a free straight edge."""
    rng = np.random.default_rng(8)
    arm, out = robot.arm, []
    while len(out) < 6:
        a, b = np.clip(arm.rest_qpos + rng.normal(0, 0.8, (2, arm.dof)), arm.lower, arm.upper)
        if not space.collides(np.stack([a, b])).any() and not space.edge_free(a, b):
            out.append((a, b))
    return out


def test_paths_are_free_and_reproducible(space, queries):
    config = SearchConfig(max_iterations=4000)
    found = 0
    for a, b in queries:
        query = MotionQuery(space, a, b[None])
        path, again, other = (tree_search(query, config, np.random.default_rng(seed)) for seed in (3, 3, 4))
        if path is None:
            continue
        found += 1
        np.testing.assert_array_equal(path, again)
        assert other is None or not np.array_equal(path, other)
        np.testing.assert_array_equal(path[[0, -1]], [a, b])
        assert _free(space, path)
        assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= config.range_rad + 1e-9
        short = shortcut(path, 40, space, np.random.default_rng(0))
        assert _free(space, short)
        assert _length(short) <= _length(path) + 1e-9
        np.testing.assert_array_equal(short[[0, -1]], path[[0, -1]])
        blends = corner_blends(short, 0.3, space)
        legs = np.linalg.norm(np.diff(short, axis=0), axis=1)
        assert np.all(blends[1:-1] <= 0.5 * np.minimum(legs[:-1], legs[1:]) + 1e-12)
    assert found >= 5


@pytest.mark.parametrize("most", [1, 6, 40, 200])
def test_the_soonest_free_goals_are_those_that_checking_all_finds(robot, space, most):
    rng, arm = np.random.default_rng(5), robot.arm
    goals = np.clip(arm.rest_qpos + rng.normal(0, 0.8, (100, arm.dof)), arm.lower, arm.upper)
    query = MotionQuery(space, arm.rest_qpos, goals, rng.uniform(0, 1, len(goals)))
    free = np.flatnonzero(~space.collides(goals))
    assert 6 < len(free) < len(goals)
    np.testing.assert_array_equal(query.soonest_free(most), free[query.among(free).by_time()][:most])


def test_a_query_ends_after_its_samples(space, queries):
    config = SearchConfig(max_iterations=1)
    paths = [
        tree_search(MotionQuery(space, a, b[None]), config, np.random.default_rng(0)) for a, b in queries
    ]
    assert any(path is None for path in paths)


def test_earlier_goals_are_reached_more_often(space, queries):
    reached = []
    for (a, b), (_, c) in pairwise(queries):
        for goals in (np.stack([b, c]), np.stack([c, b])):
            query = MotionQuery(space, a, goals)
            paths = [tree_search(query, SearchConfig(), np.random.default_rng(seed)) for seed in range(10)]
            reached += [np.array_equal(path[-1], goals[0]) for path in paths if path is not None]
    assert 0.6 < np.mean(reached) < 1


def test_one_of_several_goals_is_reached(space, queries):
    a, b = queries[0]
    goals = np.stack([b, queries[1][1], queries[2][1]])
    path, chosen = free_path(MotionQuery(space, a, goals), SearchConfig(), np.random.default_rng(0))
    np.testing.assert_array_equal(path[-1], goals[chosen])
    np.testing.assert_array_equal(path[0], a)


def test_the_goal_that_costs_least_in_all_is_taken(space, robot):
    rest = robot.arm.rest_qpos
    goals = np.stack([rest + 0.02 * k for k in (1, 2, 3)])
    for later_s, expected in ((None, 0), (np.array([5.0, 1.0, 5.0]), 1), (np.array([5.0, 5.0, 0.0]), 2)):
        query = MotionQuery(space, rest, goals, later_s)
        _, chosen = free_path(query, SearchConfig(), np.random.default_rng(0))
        assert chosen == expected


def test_goals_or_starts_that_touch_something_are_none(robot, space, queries):
    low = np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert space.collides(low[None])[0]
    config = MotionConfig()
    for start, goal in ((queries[0][0], low), (low, queries[0][0])):
        query = MotionQuery(space, start, goal[None])
        failed = timed_motion(query, robot.arm, config, np.random.default_rng(0))
        assert failed is PlanStage.FREE


def test_standing_still_takes_no_time_to_speak_of(robot, space):
    rest = robot.arm.rest_qpos
    query = MotionQuery(space, rest, rest[None])
    trajectory, _ = timed_motion(query, robot.arm, MotionConfig(), np.random.default_rng(0))
    assert trajectory.duration_s < 0.1
    assert not trajectory.qvel.any()


def _free(space, path):
    return all(space.edge_free(a, b) for a, b in pairwise(path))


def _length(path):
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum()


def test_room_is_all_that_the_ends_leave(space, queries):
    """Start and goals touch none of the larger boxes; each box of the next size they would touch."""
    room_m, found = 0.2, set()
    for a, b in queries:
        given = MotionQuery(space, a, b[None])
        roomy = given.with_room(room_m)
        by_m = (roomy.space.world.boxes[:, 3:] - space.world.boxes[:, 3:]) / room_m
        assert np.allclose(by_m, by_m[:, :1])
        assert set(np.round(by_m[:, 0], 9)) <= {0.0, 0.5, 1.0}
        assert not roomy.space.collides(np.stack([a, b])).any()
        for box, share in enumerate(by_m[:, 0]):
            if share < 0.9:
                next_m = np.zeros(len(by_m))
                next_m[box] = room_m * (share + 0.5)
                assert grown(space, next_m).collides(np.stack([a, b])).any()
        found |= set(by_m[:, 0].round(9).tolist())
    assert len(found) > 1


def test_a_goal_in_contact_takes_no_room_away(space, queries):
    a, b = queries[0]
    drawn = np.random.default_rng(0).uniform(space.lower, space.upper, (500, len(a)))
    deep = drawn[space.collides(drawn)][0]
    alone, both = (MotionQuery(space, a, goals).with_room(0.008) for goals in (b[None], np.stack([b, deep])))
    np.testing.assert_array_equal(alone.space.world.boxes, both.space.world.boxes)
