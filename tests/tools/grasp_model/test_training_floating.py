"""The floating gripper: a perfect grasp holds, one beside the object misses, and no trial depends on another."""

import numpy as np
import pytest

from tools.grasp_model.dataset import Cause
from tools.grasp_model.floating import FloatingGripper
from tools.grasp_model.floating_model import build_floating
from torc.objects.models import CollisionPiece, ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.robots.loading import load_robot
from torc.workspace.files import load_workspace

SIZE = (0.05, 0.06, 0.10)
BOX = ObjectModel("box", "box", "a box", 0.2, (CollisionPiece("box", tuple(s / 2 for s in SIZE)),), (), SIZE)
X, Y, TABLE = 0.65, -0.12, load_workspace().support_z_m


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
        build_floating(problem((X, Y)), load_robot(), load_workspace(), load_model=lambda name: BOX)
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


def test_trials_are_independent_and_repeat_bit_for_bit():
    floating = build_floating(
        problem((X, Y), (X, Y - 0.1), (X + 0.1, Y)),
        load_robot(),
        load_workspace(),
        load_model=lambda name: BOX,
    )
    grasp = pose((X, Y, TABLE + 0.065), (0.3, 0.1, -1), (0, 1, 0))
    a, b = FloatingGripper(floating), FloatingGripper(floating)
    first = a.trial(0, grasp, 0.06)
    after_first = a.data.qpos.copy()
    b.trial(1, pose((X, Y - 0.1, TABLE + 0.05), (1, 0, 0), (0, 1, 0)), 0.06)
    assert b.trial(0, grasp, 0.06) == first
    assert np.array_equal(b.data.qpos, after_first)
