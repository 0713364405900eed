"""Pick plans hold what they promise, on an independent check of the robot's full geometry."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.motion_checker import PlanChecker
from torc.geometry.transforms import invert, transform_points
from torc.motion.config import CartesianConfig, MotionConfig, SearchConfig
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.records import GraspStatus, PickPlan, PlanFailure, PlanStage
from torc.robots.kinematics import tool0_poses

SEGMENTS = ("free", "approach", "lift", "transfer", "home")


@pytest.fixture(scope="session")
def checker(robot, workspace):
    return PlanChecker(robot, workspace)


def _same(a, b):
    return all(
        np.array_equal(getattr(getattr(a, s), f), getattr(getattr(b, s), f))
        for s in SEGMENTS
        for f in ("times_s", "qpos", "qvel")
    )


@pytest.mark.parametrize("seed", range(9))
def test_plans_pass_the_independent_checker(planner, checker, request_for, seed):
    requests = request_for(seed)
    assert requests
    # One object per scene, another one in each.
    for request in [*requests[seed % len(requests) :], *requests]:
        plan = planner.plan_pick(request, np.random.default_rng(seed))
        if isinstance(plan, PickPlan):
            break
    assert isinstance(plan, PickPlan), plan
    assert checker.faults(plan, request) == []
    assert plan.object_id == request.object_id
    assert request.grasps.object_ids[plan.grasp_index] == request.object_id


@pytest.mark.usefixtures("any_arrays")
@pytest.mark.parametrize("seed", range(3))
def test_no_held_object_touches_the_robot(planner, checker, request_for, seed):
    """Objects that reach back under the arm: what is planned is sound, and some are planned."""
    for request in request_for(seed)[:2]:
        plan = planner.plan_pick(_with_a_tail(request), np.random.default_rng(seed))
        if isinstance(plan, PickPlan):
            assert checker.faults(plan, _with_a_tail(request)) == []


@pytest.mark.usefixtures("any_arrays")
def test_the_checker_sees_a_held_object_on_the_robot(planner, checker, request_for):
    """Plans for objects as they are, checked as if they reached further."""
    for request in request_for(0):
        plan = planner.plan_pick(request, np.random.default_rng(0))
        if isinstance(plan, PickPlan):
            faults = checker.faults(plan, _with_a_tail(request))
            if any("the held object touches" in fault for fault in faults):
                return
    pytest.fail("No fault was found.")


def _with_a_tail(request):
    """The request as if the object reached 45 cm towards the robot, high above the table."""
    seen = request.scene.object(request.object_id)
    tail = seen.points.mean(axis=0) + np.outer(np.linspace(0, 1, 40), [-0.45, 0.0, 0.12])
    longer = replace(seen, points=np.vstack([seen.points, tail.astype(np.float32)]))
    objects = tuple(longer if o.id == seen.id else o for o in request.scene.objects)
    return replace(request, scene=replace(request.scene, objects=objects))


@pytest.mark.long
def test_nearly_every_graspable_object_can_be_planned_for(planner, request_for):
    requests = [request for seed in range(6) for request in request_for(seed)]
    plans = [planner.plan_pick(request, np.random.default_rng(0)) for request in requests]
    assert len(requests) > 20
    assert np.mean([isinstance(plan, PickPlan) for plan in plans]) > 0.85


def test_the_checker_sees_what_is_wrong(planner, checker, request_for):
    request = request_for(0)[0]
    plan = planner.plan_pick(request, np.random.default_rng(0))
    assert isinstance(plan, PickPlan)
    assert checker.faults(plan, request) == []
    fast = replace(plan.free, times_s=plan.free.times_s / 2, qvel=plan.free.qvel * 2)
    through = replace(plan.free, qpos=plan.free.qpos.copy())
    n = len(through.qpos)
    through.qpos[n // 3 : 2 * n // 3, 1] += 0.9
    bent = replace(plan.approach, qpos=plan.approach.qpos.copy())
    bent.qpos[len(bent.qpos) // 2, 3] += 0.05
    wrong = {
        "too fast": replace(plan, free=fast),
        "touch": replace(plan, free=through),
        "off its line": replace(plan, approach=bent),
        "does not start": replace(plan, transfer=plan.home),
    }
    for text, broken in wrong.items():
        assert any(text in fault for fault in checker.faults(broken, request)), text


def test_the_same_request_has_the_same_answer(robot, workspace, request_for):
    requests = [request_for(seed)[-1] for seed in range(3)]
    plans = []
    for _ in range(2):
        planner = SamplingMotionPlanner(robot, workspace)
        plans.append([planner.plan_pick(r, np.random.default_rng(1)) for r in requests])
    for a, b in zip(*plans):
        assert isinstance(a, PickPlan)
        assert _same(a, b)


def test_it_starts_from_anywhere_free(planner, checker, request_for):
    request = request_for(1)[0]
    first = planner.plan_pick(request, np.random.default_rng(0))
    moved = replace(request, qpos_start=first.free.qpos[len(first.free.qpos) // 2])
    plan = planner.plan_pick(moved, np.random.default_rng(0))
    assert isinstance(plan, PickPlan)
    assert checker.faults(plan, moved) == []


def test_a_start_among_voxels_is_taken_to_be_free(planner, request_for):
    request = request_for(3)[0]
    first = planner.plan_pick(request, np.random.default_rng(0))
    inside = replace(request, qpos_start=first.approach.qpos[-1], object_id=request_for(3)[-1].object_id)
    plan = planner.plan_pick(inside, np.random.default_rng(0))
    assert isinstance(plan, PickPlan), plan


def test_an_object_without_valid_grasps_fails_at_the_choice(planner, request_for):
    request = request_for(0)[0]
    status = np.full(len(request.grasps), GraspStatus.BLOCKED, dtype=np.uint8)
    failed = planner.plan_pick(
        replace(request, report=replace(request.report, status=status)), np.random.default_rng(0)
    )
    assert failed == PlanFailure(PlanStage.GRASP_CHOICE, failed.reason, 0)


def test_a_grasp_out_of_reach_fails_at_inverse_kinematics(planner, request_for):
    request = request_for(0)[0]
    far = request.grasps.Ts_world_tcp.copy()
    far[:, 0, 3] += 2.0
    report = replace(request.report, qpos=np.full_like(request.report.qpos, np.nan))
    failed = planner.plan_pick(
        replace(request, grasps=replace(request.grasps, Ts_world_tcp=far), report=report),
        np.random.default_rng(0),
    )
    assert isinstance(failed, PlanFailure)
    assert failed.stage == PlanStage.INVERSE_KINEMATICS
    assert 1 <= failed.grasps_tried <= MotionConfig().max_grasps


def test_impossible_lines_fail_at_the_approach(robot, workspace, request_for):
    config = MotionConfig(cartesian=CartesianConfig(back_offs_m=(1.5,)))
    failed = SamplingMotionPlanner(robot, workspace, config).plan_pick(
        request_for(0)[0], np.random.default_rng(0)
    )
    assert isinstance(failed, PlanFailure)
    assert failed.stage == PlanStage.APPROACH


def test_a_walled_in_arm_fails_at_the_free_motion(robot, workspace, request_for):
    request = request_for(0)[0]
    # A wall between the arm at rest and all pre-grasps, wider and higher than the arm reaches.
    boxes = np.vstack([request.world.boxes, [0.36, -2.0, 0.0, 0.38, 2.0, 3.0]])
    world = replace(request.world, boxes=boxes, box_names=(*request.world.box_names, "wall"))
    config = MotionConfig(max_grasps=2, search=SearchConfig(max_iterations=100))
    failed = SamplingMotionPlanner(robot, workspace, config).plan_pick(
        replace(request, world=world), np.random.default_rng(0)
    )
    assert isinstance(failed, PlanFailure)
    assert failed.stage in (PlanStage.INVERSE_KINEMATICS, PlanStage.APPROACH, PlanStage.FREE)


def test_a_bin_out_of_reach_fails_at_the_transfer(robot, workspace, request_for):
    away = replace(workspace, drop_position=(-1.5, -1.5, 1.0))
    config = MotionConfig(max_grasps=1)
    failed = SamplingMotionPlanner(robot, away, config).plan_pick(request_for(0)[0], np.random.default_rng(0))
    assert isinstance(failed, PlanFailure)
    assert failed.stage == PlanStage.TRANSFER


@pytest.mark.parametrize("y", [0.0, 0.1])
def test_the_hidden_foot_of_a_held_object_clears_table_and_bin(robot, workspace, request_behind, y):
    """Planned from the half that the camera sees, and from a low lift; checked with the whole."""
    request, low = request_behind(y), MotionConfig(cartesian=CartesianConfig(lifts_m=(0.05,)))
    planner = SamplingMotionPlanner(robot, workspace, low)
    assert request.scene.object(1).points[:, 2].min() > workspace.support_z_m + 0.08
    half = np.array([0.025, 0.025, 0.14])
    steps = np.stack(np.meshgrid(*3 * [np.linspace(-1.0, 1.0, 11)]), axis=-1).reshape(-1, 3)
    whole = steps * half + (0.68, y, workspace.support_z_m + 0.14)
    for seed in range(3):
        plan = planner.plan_pick(request, np.random.default_rng(seed))
        assert isinstance(plan, PickPlan)
        T_grasp_world = invert(tool0_poses(robot.arm, plan.lift.qpos[:1])[0])
        for T in tool0_poses(robot.arm, plan.transfer.qpos[::5]):
            points = transform_points(T @ T_grasp_world, whole)
            for box in workspace.static_boxes():
                depth = np.asarray(box.size) / 2 - np.abs(points - np.asarray(box.center))
                assert not np.any(depth.min(axis=1) > 0), box.name
