"""The floating gripper: a perfect grasp holds, one beside the object misses, and no trial depends on another."""

import numpy as np
import pytest

from tools.grasp_model.carry_path import smooth_steps
from tools.grasp_model.dataset import Cause
from tools.grasp_model.floating import FloatingGripper
from tools.grasp_model.floating_model import build_floating
from torc.objects.models import CollisionPiece, ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.robots.loading import load_robot
from torc.workspace.description import Workspace

SIZE = (0.05, 0.06, 0.10)
BOX = ObjectModel("box", "box", "a box", 0.2, (CollisionPiece("box", tuple(s / 2 for s in SIZE)),), (), SIZE)
X, Y, TABLE = 0.65, -0.12, Workspace().support_z_m


def problem(*xy: tuple[float, float]) -> Problem:
    placements = tuple(
        ObjectPlacement(f"box_{i}", "box", (x, y, TABLE + SIZE[2] / 2), (1.0, 0.0, 0.0, 0.0))
        for i, (x, y) in enumerate(xy)
    )
    return Problem("boxes", "structured", "", "box_0", placements)


def pose(position, approach, closing) -> np.ndarray:
    z = np.array(approach, float) / np.linalg.norm(approach)
    x = np.array(closing, float) - z * np.dot(z, closing)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), position
    return T


@pytest.fixture(scope="module")
def lone() -> FloatingGripper:
    return FloatingGripper(
        build_floating(problem((X, Y)), load_robot(), Workspace(), load_model=lambda name: BOX)
    )


DOWN = (0, 0, -1)


def test_perfect_grasps_hold(lone):
    top = lone.trial(0, pose((X, Y, TABLE + 0.065), DOWN, (1, 0, 0)), 0.05)
    side = lone.trial(0, pose((X + 0.01, Y, TABLE + 0.06), (1, 0, 0), (0, 1, 0)), 0.06)
    tilted = lone.trial(0, pose((X, Y, TABLE + 0.065), (0.5, 0, -1), (0, 1, 0)), 0.06)
    for outcome in (top, side, tilted):
        assert outcome.delivered
        assert outcome.cause == Cause.DELIVERED
        assert outcome.others_moved == outcome.others_dropped == ()


def test_beside_the_object_misses(lone):
    outcome = lone.trial(0, pose((X, Y - 0.18, TABLE + 0.065), DOWN, (1, 0, 0)), 0.05)
    assert outcome.cause == Cause.MISSED
    assert not outcome.delivered


def test_finger_on_the_object_stops(lone):
    outcome = lone.trial(0, pose((X + 0.035, Y, TABLE + 0.05), DOWN, (1, 0, 0)), 0.05)
    assert outcome.cause == Cause.STOPPED
    assert 0.03 < outcome.stopped_short_m < 0.06
    assert 40 < outcome.max_force_n < 60


def test_start_inside_an_object_counts_as_stopped(lone):
    assert lone.trial(0, pose((X, Y, TABLE - 0.05), DOWN, (1, 0, 0)), 0.05).cause == Cause.STOPPED


def test_above_the_object_misses(lone):
    outcome = lone.trial(0, pose((X, Y, TABLE + SIZE[2] + 0.02), DOWN, (1, 0, 0)), 0.05)
    assert outcome.cause == Cause.MISSED


def test_trials_are_independent_and_repeat_bit_for_bit():
    floating = build_floating(
        problem((X, Y), (X, Y - 0.1), (X + 0.1, Y)), load_robot(), Workspace(), load_model=lambda name: BOX
    )
    grasp = pose((X, Y, TABLE + 0.065), (0.3, 0.1, -1), (0, 1, 0))
    a, b = FloatingGripper(floating), FloatingGripper(floating)
    first = a.trial(0, grasp, 0.06)
    after_first = a.data.qpos.copy()
    b.trial(1, pose((X, Y - 0.1, TABLE + 0.05), (1, 0, 0), (0, 1, 0)), 0.06)
    assert b.trial(0, grasp, 0.06) == first
    assert np.array_equal(b.data.qpos, after_first)


def test_a_neighbour_pushed_away_is_noticed():
    floating = build_floating(
        problem((X, Y), (X + 0.075, Y)), load_robot(), Workspace(), load_model=lambda name: BOX
    )
    outcome = FloatingGripper(floating).trial(
        0, pose((X, Y, TABLE + 0.065), (-0.9, 0, -0.4), (0, 1, 0)), 0.06
    )
    assert 1 in outcome.others_moved or outcome.cause == Cause.STOPPED


def test_objects_rest_at_the_start():
    floating = build_floating(
        problem((X, Y), (X, Y - 0.1)), load_robot(), Workspace(), load_model=lambda name: BOX
    )
    heights = floating.settled.xpos[floating.object_bodies, 2]
    assert np.allclose(heights, TABLE + SIZE[2] / 2, atol=5e-4)
    assert np.abs(floating.settled.qvel[floating.linear_dofs]).max() < 1e-3


def test_smooth_steps_start_and_end_at_rest():
    shares = smooth_steps(50)
    assert shares[-1] == 1.0
    assert (np.diff(shares) > 0).all()
    assert shares[0] < 1e-4
    assert 1 - shares[-2] < 1e-4
