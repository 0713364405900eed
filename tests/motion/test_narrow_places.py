"""Into a shelf and out of it, where free motions alone often find no way."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.marks import long
from tests.helpers.motion_checker import PlanChecker
from torc.collision.collision_world import CollisionConfig
from torc.motion.config import CartesianConfig, MotionConfig, SearchConfig
from torc.motion.protocol import PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.records import PickPlan
from torc.robots.kinematics import sphere_centers

SHORT = MotionConfig(search=SearchConfig(max_iterations=60))
"""Searches so short that they often fail."""
NO_LINES = replace(SHORT, cartesian=CartesianConfig(line_out_m=0.005))


@pytest.fixture(scope="module")
def plans(robot, shelf, requests_in_shelf):
    """Per settings, what is planned for each request."""
    return {
        name: [
            SamplingMotionPlanner(robot, shelf, config).plan_pick(r, np.random.default_rng(0))
            for r in requests_in_shelf
        ]
        for name, config in {"lines": SHORT, "no lines": NO_LINES}.items()
    }


@pytest.mark.long
def test_lines_find_ways_where_the_search_alone_does_not(plans):
    found = {name: sum(isinstance(p, PickPlan) for p in planned) for name, planned in plans.items()}
    assert found["lines"] >= found["no lines"] + 2


@pytest.mark.long
def test_what_is_planned_with_lines_passes_the_independent_checker(robot, shelf, plans, requests_in_shelf):
    checker, checked = PlanChecker(robot, shelf), 0
    for request, without, plan in zip(requests_in_shelf, plans["no lines"], plans["lines"]):
        if isinstance(plan, PickPlan) and not isinstance(without, PickPlan):
            assert checker.faults(plan, request) == []
            checked += 1
    assert checked >= 2


@pytest.mark.parametrize("x", [0.66, *long(0.68, 0.70)])
def test_what_is_close_to_wall_and_roof_leaves_them_first(robot, shelf, request_by_the_wall, x):
    request = request_by_the_wall(x)
    plan = SamplingMotionPlanner(robot, shelf).plan_pick(request, np.random.default_rng(0))
    assert isinstance(plan, PickPlan), plan
    assert PlanChecker(robot, shelf).faults(plan, request) == []


@pytest.mark.parametrize("into_wall_m", [*long(0.02, 0.04), 0.06])
@pytest.mark.parametrize("x", [0.66, *long(0.70)])
def test_an_object_smeared_into_a_wall_ends_at_the_wall(robot, shelf, request_by_the_wall, x, into_wall_m):
    true = request_by_the_wall(x)
    request = smeared(true, (0.0, -into_wall_m, 0.0))
    plan = SamplingMotionPlanner(robot, shelf).plan_pick(request, np.random.default_rng(0))
    assert isinstance(plan, PickPlan), plan
    assert PlanChecker(robot, shelf).faults(plan, true) == []


def smeared(request: PickRequest, by_m: tuple[float, float, float]) -> PickRequest:
    """The request with the points of its object twice, once where they are not, as rough depth may have them."""
    scene, own = request.scene, request.scene.object(request.object_id)
    points = np.concatenate([own.points, own.points + np.float32(by_m)])
    twice = [np.concatenate([a, a]) for a in (own.normals, own.pixels)]
    wrong = replace(own, points=points, normals=twice[0], pixels=twice[1])
    objects = tuple(wrong if o.id == own.id else o for o in scene.objects)
    return replace(request, scene=replace(scene, objects=objects))


@pytest.mark.long
def test_free_motions_keep_room_to_shelf_and_table_where_their_ends_do(robot, shelf, requests_in_shelf):
    """Without room most come closer to something fixed than the gripper is at either end, by more than they may graze
    it.
    """
    grazing_m = SearchConfig().grazing_m
    close = {}
    for room_m in (0.0, SearchConfig().room_m):
        config = MotionConfig(search=SearchConfig(room_m=room_m))
        planned = [
            SamplingMotionPlanner(robot, shelf, config).plan_pick(r, np.random.default_rng(0))
            for r in requests_in_shelf
        ]
        rooms = [_closer_than_ends_m(robot, shelf, p.free.qpos) for p in planned if isinstance(p, PickPlan)]
        close[room_m] = sum(m > grazing_m for m in rooms), len(rooms)
    (without, first), (with_room, second) = close.values()
    assert second == first
    assert without >= 0.6 * first
    assert with_room <= 0.3 * second


def _closer_than_ends_m(robot, workspace, qpos):
    """By how much the gripper comes closer to some fixed box than at both ends, up to the room that it may have."""
    config = CollisionConfig()
    most_m = config.gripper_static_padding_m + SearchConfig().room_m
    gripper = robot.spheres.link >= len(robot.arm.joint_names)
    centers = sphere_centers(robot, qpos, np.full(len(qpos), robot.gripper.max_width_m))[:, gripper]
    gaps = [
        np.linalg.norm(np.maximum(np.abs(centers - b.center) - np.array(b.size) / 2, 0), axis=2)
        - robot.spheres.radii[gripper]
        for b in workspace.static_boxes()
    ]
    nearest = np.stack([g.min(axis=1) for g in gaps])
    ends = np.minimum(np.minimum(nearest[:, 0], nearest[:, -1]), most_m)
    return float((ends - nearest.min(axis=1)).max())
