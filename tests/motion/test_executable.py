"""A valid grasp has straight motions: the batch says what the planner would find, grasp by grasp."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.marks import long
from torc.motion.config import CartesianConfig, MotionConfig
from torc.motion.executable import without_lines
from torc.motion.lines import LineContext, line_candidates, lines_exist
from torc.motion.mover import Mover
from torc.motion.protocol import NoMotionError, PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.records import GraspStatus
from torc.robots.kinematics import tool0_poses


def asked(request: PickRequest, robot, workspace, config: MotionConfig) -> np.ndarray:
    return without_lines(
        request.grasps,
        request.report,
        request.scene,
        request.volume,
        request.world,
        robot,
        workspace.support_z_m,
        config,
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


def some(qpos: np.ndarray, one_in: int) -> np.ndarray:
    """One configuration in so many, always the same."""
    return np.floor(1e4 * np.abs(qpos).sum(axis=-1)) % one_in == 0


@pytest.mark.parametrize(
    ("config", "one_in"),
    [
        pytest.param(CartesianConfig(limit_margin_rad=0.5), None, id="many-branches-in-vain"),
        pytest.param(
            CartesianConfig(limit_margin_rad=0.4, max_rounds=1, max_branches=1), None, id="few-tried"
        ),
        pytest.param(CartesianConfig(max_rounds=2, max_branches=5), 3, id="contacts-here-and-there"),
        pytest.param(CartesianConfig(max_rounds=2, max_branches=5), 9, id="fewer-contacts"),
    ],
)
def test_lines_exist_where_candidates_are_found(request_for, robot, workspace, monkeypatch, config, one_in):
    """Also of grasps that are not valid, and where lines are hard to find."""
    planner, found = SamplingMotionPlanner(robot, workspace, MotionConfig(cartesian=config)), []
    unknown = np.full(robot.arm.dof, np.nan)
    if one_in:
        contacts = LineContext.contacts

        def more_contacts(self, qpos):
            told = contacts(self, qpos)
            return replace(told, static=told.static | ~some(qpos, 3))

        monkeypatch.setattr(LineContext, "contacts", more_contacts)
        monkeypatch.setattr(LineContext, "hits_fixed", lambda self, q: bool(some(q, 5 * one_in).any()))
        monkeypatch.setattr(
            LineContext, "hits_robot_when_held", lambda self, q: bool(some(q, 4 * one_in + 1).any())
        )
    for seed in range(3):
        request = request_for(seed)[0]
        for grasp in range(0, len(request.grasps), 5):
            own = replace(request, object_id=int(request.grasps.object_ids[grasp]))
            context = planner.context(own, grasp, planner.held(own))
            try:
                there = len(line_candidates(context, unknown, own.qpos_start)) > 0
            except NoMotionError:
                there = False
            assert lines_exist(context, unknown) == there
            found.append(there)
    assert 0.04 < np.mean(found) < 0.9, np.mean(found)


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
    first, _ = mover.follow(arm.rest_qpos[None], T, up, 0.101, waypoints=3)
    np.testing.assert_array_equal(first, paths[:, :3])
