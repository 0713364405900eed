"""A valid grasp has straight motions: the batch says what the planner would find, grasp by grasp."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.marks import long
from torc.motion.config import CartesianConfig, MotionConfig
from torc.motion.executable import without_lines
from torc.motion.lines import line_candidates
from torc.motion.mover import Mover
from torc.motion.protocol import NoMotionError, PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.records import GraspStatus
from torc.robots.kinematics import tool0_poses


def asked(request: PickRequest, robot, workspace, config: MotionConfig, most=10**6) -> np.ndarray:
    return without_lines(
        request.grasps,
        request.report,
        request.scene,
        request.volume,
        request.world,
        robot,
        workspace.support_z_m,
        replace(config, max_grasps=most),
    )


def one_by_one(request: PickRequest, planner: SamplingMotionPlanner) -> np.ndarray:
    out = np.zeros(len(request.grasps), dtype=bool)
    for grasp in np.flatnonzero(request.report.status == GraspStatus.VALID).tolist():
        own = replace(request, object_id=int(request.grasps.object_ids[grasp]))
        context = planner.context(own, grasp, planner.held(own))
        try:
            line_candidates(context, request.report.qpos[grasp], request.qpos_start)
        except NoMotionError:
            out[grasp] = True
    return out


@pytest.mark.parametrize("seed", [0, *long(1, 2)])
def test_it_says_what_the_planner_finds(planner, request_for, robot, workspace, seed):
    request = request_for(seed)[0]
    found = asked(request, robot, workspace, planner.config)
    np.testing.assert_array_equal(found, one_by_one(request, planner))
    assert not found[request.report.status != GraspStatus.VALID].any()


@pytest.mark.long
def test_with_longer_lines_fewer_can_be_carried_out(request_for, robot, workspace):
    far = MotionConfig(cartesian=CartesianConfig(back_offs_m=(0.2, 0.16), lifts_m=(0.3, 0.25)))
    short = found = valid = 0
    for seed in range(2):
        request = request_for(seed)[0]
        short += np.count_nonzero(asked(request, robot, workspace, MotionConfig()))
        long = asked(request, robot, workspace, far)
        np.testing.assert_array_equal(long, one_by_one(request, SamplingMotionPlanner(robot, workspace, far)))
        found += np.count_nonzero(long)
        valid += np.count_nonzero(request.report.status == GraspStatus.VALID)
    assert short < found < valid


def with_boxes(world, count: int, workspace):
    """The world with small fixed boxes in the air, always the same."""
    rng = np.random.default_rng(count)
    center = workspace.table.center + rng.uniform([-0.3, -0.4, 0.1], [0.3, 0.4, 0.45], (count, 3))
    boxes = np.hstack([center - 0.015, center + 0.015])
    names = tuple(f"box {k}" for k in range(count))
    return replace(world, boxes=np.vstack([world.boxes, boxes]), box_names=world.box_names + names)


@pytest.mark.parametrize(
    ("config", "boxes"),
    [
        pytest.param(CartesianConfig(limit_margin_rad=0.5), 0, id="many-branches-in-vain"),
        pytest.param(CartesianConfig(limit_margin_rad=0.4, max_rounds=1, max_branches=1), 0, id="few-tried"),
        pytest.param(CartesianConfig(max_rounds=2, max_branches=5), 60, id="contacts-here-and-there"),
        pytest.param(CartesianConfig(max_rounds=2, max_branches=5), 15, id="fewer-contacts"),
    ],
)
def test_lines_exist_where_candidates_are_found(request_for, robot, workspace, config, boxes):
    """Also of grasps that are not valid, and where lines are hard to find."""
    planner, found = SamplingMotionPlanner(robot, workspace, MotionConfig(cartesian=config)), []
    for seed in range(3):
        request = request_for(seed)[0]
        status = np.full_like(request.report.status, GraspStatus.HITS_STATIC)
        status[::5] = GraspStatus.VALID
        unknown = replace(request.report, status=status, qpos=np.full_like(request.report.qpos, np.nan))
        request = replace(request, report=unknown, world=with_boxes(request.world, boxes, workspace))
        stuck = asked(request, robot, workspace, planner.config)
        np.testing.assert_array_equal(stuck, one_by_one(request, planner))
        found += (~stuck[::5]).tolist()
    assert 0.04 < np.mean(found) < 0.9, np.mean(found)


@pytest.mark.parametrize("most", [1, 3])
def test_no_more_grasps_are_followed_than_are_asked_for(request_for, robot, workspace, most):
    config, stopped = MotionConfig(cartesian=CartesianConfig(limit_margin_rad=0.3)), 0
    for seed in range(2):
        request = request_for(seed)[0]
        every, some = (asked(request, robot, workspace, config, most=m) for m in (10**6, most))
        for k in request.report.object_ids:
            ranked = request.grasps.of(k)
            ranked = ranked[request.report.status[ranked] == GraspStatus.VALID]
            best = ranked[~every[ranked]][:most]
            np.testing.assert_array_equal(ranked[~some[ranked]][:most], best)
            last = np.flatnonzero(ranked == best[-1])[0] if len(best) == most else len(ranked)
            np.testing.assert_array_equal(some[ranked[:last]], every[ranked[:last]])
            assert np.all(every[ranked[some[ranked]]])
            stopped += np.any(every[ranked] & ~some[ranked])
    assert stopped > 0


def test_ways_are_the_same_with_any_number_of_threads(request_for, robot, workspace, monkeypatch):
    config, request, found = (
        MotionConfig(cartesian=CartesianConfig(limit_margin_rad=0.3)),
        request_for(1)[0],
        [],
    )
    for threads in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        found.append(asked(request, robot, workspace, config, most=2))
    np.testing.assert_array_equal(*found)
    assert found[0].any()


def test_no_valid_grasps_need_no_lines(request_for, robot, workspace):
    request = request_for(0)[0]
    none = np.full_like(request.report.status, GraspStatus.BLOCKED)
    request = replace(request, report=replace(request.report, status=none))
    assert not asked(request, robot, workspace, MotionConfig()).any()


CONFIG = MotionConfig(cartesian=CartesianConfig(limit_margin_rad=0.0, max_joint_step_rad=0.15))


def _starts(robot, n=60):
    rng = np.random.default_rng(3)
    arm = robot.arm
    q = np.clip(arm.rest_qpos + rng.normal(0, 0.5, (n, arm.dof)), arm.lower + 0.1, arm.upper - 0.1)
    return q, tool0_poses(arm, q)


def test_what_is_followed_is_on_the_line_within_limits_and_without_jumps(robot):
    arm, mover = robot.arm, Mover(robot, CONFIG)
    reached = 0
    for q, T in zip(*_starts(robot)):
        direction = np.array([0.0, 0.6, 0.8])
        paths, counts = mover.follow(q[None], T[None], direction, 0.12)
        n = int(counts[0])
        assert paths.shape[1] == 24
        reached += n == 24
        if n:
            path = np.vstack([q, paths[0, :n]])
            poses = np.tile(T, (n, 1, 1))
            poses[:, :3, 3] += np.outer(0.005 * np.arange(1, n + 1), direction)
            np.testing.assert_allclose(tool0_poses(arm, path[1:]), poses, atol=2e-5)
            assert np.all((path[1:] >= arm.lower) & (path[1:] <= arm.upper))
            assert np.abs(np.diff(path, axis=0)).max() <= 0.15
        assert np.all(np.isnan(paths[0, n:]))
    assert 30 < reached < 60


def test_lines_end_where_they_should(robot):
    arm, mover = robot.arm, Mover(robot, CONFIG)
    up = np.array([[0.0, 0.0, 1.0]])
    T = tool0_poses(arm, arm.rest_qpos[None])
    paths, counts = mover.follow(arm.rest_qpos[None], T, up, 0.101)
    assert counts[0] == 21
    end = tool0_poses(arm, paths[0, -1:])[0]
    np.testing.assert_allclose(end[:3, 3] - T[0, :3, 3], [0, 0, 0.101], atol=2e-5)
