"""Free motions by a server: the world that it is told, and what becomes of the motions that it gives."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.motion_checker import PlanChecker
from torc.collision.contacts import static_contacts
from torc.errors import NetworkError
from torc.motion.lines import line_candidates, timed_lines
from torc.pipeline.building import build_system, make_stage
from torc.records import PickPlan, PlanFailure, PlanStage
from torc.registry.context import BuildContext
from torc.robots.kinematics import tool0_poses
from torc.specs.conditions import Conditions
from torc.testing.motion_conformance import check_motion_planner, requests
from torc_networks.motion.planner import CuroboConfig, CuroboMotionPlanner

FREE_MOTIONS = ("free", "transfer", "home")


@pytest.fixture(scope="module")
def request_of_a_pick():
    return requests()[0]


@pytest.fixture
def planner_of(robot, workspace, server_of):
    """The stage, with a server that answers so."""

    def make(answer, **settings):
        return CuroboMotionPlanner(robot, workspace, CuroboConfig(server=server_of(plan=answer), **settings))

    return make


@pytest.fixture
def sampling(own_parts):
    """The handler of torc's own planner."""
    return own_parts.plan


def _plan(planner, request, seed=0):
    return planner.plan_pick(request, np.random.default_rng(seed))


def test_what_the_server_is_told_of_the_world(request_of_a_pick, robot, planner_of, told, sampling):
    _plan(planner_of(sampling), request_of_a_pick)
    asked, world = told["plan"], request_of_a_pick.world
    grid = world.grid
    # C order, x y z: the value of voxel (i, j, k) is at (i * ny + j) * nz + k.
    assert asked["esdf"].shape == grid.shape
    assert asked["esdf"].flags["C_CONTIGUOUS"]
    # Points that the motion must not touch lie in voxels below zero, by the pose of the centre alone.
    surface = request_of_a_pick.scene.object(2).points[::7].astype(float)
    low = asked["pose"][:3] - 0.5 * asked["voxel_size"] * np.array(asked["esdf"].shape)
    i, j, k = np.floor((surface - low) / asked["voxel_size"]).astype(int).T
    assert (asked["esdf"].ravel()[(i * grid.shape[1] + j) * grid.shape[2] + k] < 0).all()
    np.testing.assert_allclose(asked["pose"], [*(grid.origin + grid.upper) / 2, 1, 0, 0, 0], atol=1e-12)
    np.testing.assert_array_equal(asked["boxes"], world.boxes)
    assert tuple(asked["joint_names"]) == robot.arm.joint_names
    np.testing.assert_allclose(asked["T_world_tool0"], tool0_poses(robot.arm, asked["start"][None])[0])


def test_the_transfer_is_asked_with_the_object_in_the_hand(request_of_a_pick, planner_of, sampling):
    asked = []

    def spied(fields):
        asked.append(fields)
        return sampling(fields)

    plan = _plan(planner_of(spied), request_of_a_pick)
    assert isinstance(plan, PickPlan)
    free, transfer, home = asked[0], asked[-2], asked[-1]
    assert len(free["attached"]) == len(home["attached"]) == 0
    assert len(transfer["attached"]) > 3
    assert transfer["width"] == pytest.approx(plan.width_m)
    np.testing.assert_array_equal(free["start"], request_of_a_pick.qpos_start)


@pytest.mark.long
def test_torcs_own_planner_behind_a_server_plans_sound_picks(planner_of, robot, workspace, sampling):
    checker, planner = PlanChecker(robot, workspace), planner_of(sampling)
    for request in requests():
        plan = _plan(planner, request)
        assert isinstance(plan, PickPlan), plan
        assert checker.faults(plan, request) == []


def test_approach_and_lift_are_torcs_own_and_the_free_motions_fit(planner_of, sampling, request_of_a_pick):
    planner, request = planner_of(sampling), request_of_a_pick
    plan = _plan(planner, request)
    context = planner.context(request, plan.grasp_index, planner.held(request))
    pairs = line_candidates(context, request.report.qpos[plan.grasp_index], request.qpos_start)
    (own,) = [p for p in pairs if np.array_equal(p.approach[0], plan.approach.qpos[0])]
    for motion, expected in zip((plan.approach, plan.lift), timed_lines(planner.mover, own)):
        np.testing.assert_array_equal(motion.qpos, expected.qpos)
        np.testing.assert_array_equal(motion.times_s, expected.times_s)
    np.testing.assert_allclose(plan.free.qpos[0], request.qpos_start, atol=1e-12)
    np.testing.assert_allclose(plan.free.qpos[-1], plan.approach.qpos[0], atol=1e-12)
    np.testing.assert_allclose(plan.transfer.qpos[0], plan.lift.qpos[-1], atol=1e-12)


@pytest.mark.parametrize("reached", [0, 1, -1])
@pytest.mark.parametrize("order", [1, -1])
def test_the_approach_is_the_one_that_the_motion_leads_to(
    planner_of, sampling, request_of_a_pick, order, reached
):
    """Whichever of the offered goals the server takes, and in whatever order they are offered."""

    def answer(fields):
        return sampling({**fields, "goals": fields["goals"][reached][None]})

    planner, request = planner_of(answer), request_of_a_pick
    grasp = int(request.grasps.of(request.object_id)[0])
    context = planner.context(request, grasp, planner.held(request))
    start = np.asarray(request.qpos_start, float)
    pairs = line_candidates(context, request.report.qpos[grasp], start)
    assert len(pairs) > 2
    rng = np.random.default_rng(0)
    motion, pair = planner.free.to_pre_grasp(context, start, pairs[::order], rng)
    np.testing.assert_allclose(motion.qpos[-1], pair.approach[0], atol=1e-9)


def test_it_conforms(robot, workspace, server_of, sampling):
    server = server_of(plan=sampling)
    check_motion_planner(
        lambda robot, workspace: CuroboMotionPlanner(robot, workspace, CuroboConfig(server=server))
    )


def test_where_the_server_finds_nothing_there_is_no_plan(planner_of, request_of_a_pick):
    found = _plan(planner_of({"failure": "trajopt did not converge"}), request_of_a_pick)
    assert isinstance(found, PlanFailure)
    assert found.stage is PlanStage.FREE
    assert "trajopt did not converge" in found.reason
    assert found.grasps_tried > 1


def test_where_the_server_finds_nothing_later_the_stage_is_told(planner_of, request_of_a_pick, sampling):
    def only_there(fields):
        return {"failure": "no"} if len(fields["attached"]) else sampling(fields)

    found = _plan(planner_of(only_there, max_grasps=1), request_of_a_pick)
    assert (found.stage, found.grasps_tried) == (PlanStage.TRANSFER, 1)


def test_an_absent_server_is_an_error_and_no_failed_pick(robot, workspace, request_of_a_pick, server_of):
    config = CuroboConfig(server=replace(server_of(), address="tcp://127.0.0.1:9"))
    with pytest.raises(NetworkError, match="nothing listens"):
        _plan(CuroboMotionPlanner(robot, workspace, config), request_of_a_pick)


def _line(fields, samples=50, seconds=5.0, via=None):
    """A straight motion in joint space, maybe by way of a configuration."""
    corners = [fields["start"], *([] if via is None else [via]), fields["goals"][0]]
    u = np.linspace(0, len(corners) - 1, samples)
    qpos = np.stack([np.interp(u, range(len(corners)), c) for c in np.transpose(corners)], axis=1)
    return {"times": np.linspace(0, seconds, samples), "positions": qpos}


@pytest.mark.long
def test_a_motion_through_an_obstacle_is_no_plan(planner_of, request_of_a_pick, robot):
    arm, world, width = robot.arm, request_of_a_pick.world, robot.gripper.max_width_m
    some = np.random.default_rng(0).uniform(arm.lower, arm.upper, (200, arm.dof))
    inside = some[static_contacts(world, robot, some, width)][0]
    found = _plan(planner_of(lambda fields: _line(fields, via=inside)), request_of_a_pick)
    assert isinstance(found, PlanFailure)
    assert (found.stage, "touches something" in found.reason) == (PlanStage.FREE, True)


def _changed(change):
    """torc's own motion, spoilt."""

    def answer(sampling):
        def handler(fields):
            motion = sampling(fields)
            times, qpos = np.array(motion["times"]), np.array(motion["positions"])
            change(times, qpos)
            return {"times": times, "positions": qpos}

        return handler

    return answer


def _begin_elsewhere(times, qpos):
    qpos[0, 3] += 0.01


def _end_elsewhere(times, qpos):
    qpos[-1, 0] -= 0.01


def _beyond_the_limits(times, qpos):
    qpos[len(qpos) // 2] = 40.0


def _forever(times, qpos):
    times *= 1000


def _not_finite(times, qpos):
    qpos[1, 1] = np.nan


def _backwards(times, qpos):
    times[:] = times[::-1].copy()


def _another_arm(times, qpos):
    qpos[:] = qpos[::-1].copy()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (_begin_elsewhere, "begins 0.010 rad from"),
        (_end_elsewhere, "ends 0.010 rad from"),
        (_beyond_the_limits, "joint limits"),
        (_forever, "would take"),
        (_not_finite, "not finite"),
        (_backwards, "'times'"),
        (_another_arm, "begins"),
    ],
)
def test_a_motion_that_was_not_asked_for_is_an_error(planner_of, request_of_a_pick, sampling, change, why):
    with pytest.raises(NetworkError, match=why):
        _plan(planner_of(_changed(change)(sampling)), request_of_a_pick)


@pytest.mark.parametrize(
    "answer",
    [{}, {"times": [0.0, 1.0]}, {"error": "no GPU"}, {"times": [0, 1], "positions": np.zeros((2, 6))}],
)
def test_nonsense_is_an_error(planner_of, request_of_a_pick, answer):
    with pytest.raises(NetworkError, match="'plan'"):
        _plan(planner_of(answer), request_of_a_pick)


def test_a_motion_that_is_too_fast_is_slowed_down(planner_of, request_of_a_pick, robot, sampling):
    def hurry(times, qpos):
        times *= 0.05

    plan = _plan(planner_of(_changed(hurry)(sampling)), request_of_a_pick)
    assert isinstance(plan, PickPlan), plan
    for name in FREE_MOTIONS:
        motion = getattr(plan, name)
        assert (np.abs(motion.qvel) <= robot.arm.max_speed + 1e-9).all()


def test_it_is_made_by_name_and_its_straight_motions_decide_what_is_valid(workspace):
    settings = {"motion.cartesian.lifts_m": [0.08], "motion.server.timeout_s": 5.0}
    spec = Conditions(motion="curobo", settings=settings)
    system = build_system(spec)
    assert isinstance(system.motion_planner, CuroboMotionPlanner)
    assert system.pipeline.motion.cartesian.lifts_m == (0.08,)
    assert system.motion_planner.config.server.timeout_s == 5
    assert (
        make_stage(
            spec, "motion", BuildContext(robot=system.robot, workspace=workspace)
        ).free.client.config.timeout_s
        == 5
    )
