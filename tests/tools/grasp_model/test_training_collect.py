"""Collecting: an interrupted collection ends like an uninterrupted one, and what is written comes back."""

import numpy as np
import pytest
from training_trials import make_trials

from tools.grasp_model.collect import CollectConfig, collect
from tools.grasp_model.dataset import (
    Cause,
    column_names,
    concatenate,
    load_shard,
    save_shard,
    shard_ranges,
)
from tools.grasp_model.facts import model_digest
from tools.grasp_model.feasibility import FeasibilityConfig, measure
from tools.grasp_model.floating import FloatingGripper
from tools.grasp_model.floating_model import build_floating
from tools.grasp_model.refresh import refresh
from tools.grasp_model.sampling import SamplingConfig
from tools.grasp_model.scenes import SceneConfig
from torc.errors import InputError
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.objects.library import GraspFact, load_object, read_facts
from torc.objects.models import CollisionPiece, ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace

pytestmark = pytest.mark.long

SMALL = CollectConfig(
    scenes=SceneConfig(min_objects=3, max_objects=4, structured_share=1.0),
    sampling=SamplingConfig(first_trials=9, later_trials=4),
    stages=2,
    taken_away=1,
    shard_trials=1,
)


def table(directory):
    return concatenate([load_shard(path) for _, _, path in shard_ranges(directory)])


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    collect(out, 2, 7, SMALL)
    return out


def test_interrupted_collection_ends_like_a_whole_one(collected, tmp_path):
    collect(tmp_path, 1, 7, SMALL)
    assert [(a, b) for a, b, _ in shard_ranges(tmp_path)] == [(0, 0)]
    collect(tmp_path, 2, 7, SMALL)
    whole, resumed = table(collected), table(tmp_path)
    for name in column_names():
        assert np.array_equal(getattr(whole, name), getattr(resumed, name)), name


def test_refreshed_trials_are_the_same_while_features_are(collected, tmp_path):
    refresh(collected, tmp_path)
    old, new = table(collected), table(tmp_path)
    assert len(new) == len(old)
    match = {T.tobytes(): i for i, T in enumerate(old.T_world_tcp)}
    index = np.array([match[T.tobytes()] for T in new.T_world_tcp])
    assert np.array_equal(old.delivered[index], new.delivered)
    assert np.allclose(old.features[index], new.features, rtol=1e-4, atol=1e-5)
    assert np.array_equal(old.valid[index], new.valid)


def test_shard_round_trip(tmp_path):
    trials = make_trials(50, seed=1)
    back = load_shard(save_shard(tmp_path, trials, 0, 19))
    assert back.feature_names == trials.feature_names
    for name in column_names():
        a, b = getattr(trials, name), getattr(back, name)
        assert np.array_equal(a, b), name
        assert a.dtype == b.dtype or a.dtype.kind == "U", name


def test_mixed_features_are_refused():
    a, b = make_trials(5, seed=1), make_trials(5, seed=2)
    object.__setattr__(b, "feature_names", ("extent", "contacts", "noise_a", "noise_b", "other"))
    with pytest.raises(InputError, match="other"):
        concatenate([a, b])


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
    box = problem((X, Y))
    return FloatingGripper(build_floating(box, load_robot(), load_workspace(), load_model=lambda name: BOX))


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
    boxes = problem((X, Y), (X, Y - 0.1), (X + 0.1, Y))
    floating = build_floating(boxes, load_robot(), load_workspace(), load_model=lambda name: BOX)
    grasp = pose((X, Y, TABLE + 0.065), (0.3, 0.1, -1), (0, 1, 0))
    a, b = FloatingGripper(floating), FloatingGripper(floating)
    first = a.trial(0, grasp, 0.06)
    after_first = a.data.qpos.copy()
    b.trial(1, pose((X, Y - 0.1, TABLE + 0.05), (1, 0, 0), (0, 1, 0)), 0.06)
    assert b.trial(0, grasp, 0.06) == first
    assert np.array_equal(b.data.qpos, after_first)


Bench = tuple[RobotDescription, GeometricGraspPlanner, Workspace]
QUICK = FeasibilityConfig(turns=1, falls=1, tries=4)


@pytest.fixture(scope="module")
def bench() -> Bench:
    robot, workspace = load_robot(), load_workspace()
    return robot, GeometricGraspPlanner(robot.gripper, workspace.support_z_m), workspace


def test_a_die_is_held_and_a_flat_plate_is_not(bench: Bench) -> None:
    die = measure("die_white", *bench, QUICK)
    assert die == GraspFact(1.0, 1.0, model_digest(load_object("die_white")))
    assert measure("plate_white", *bench, QUICK).standing == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["teacup_blue", "book_blue", "toy_plane_red"])
def test_the_shipped_facts_are_what_is_measured(name: str, bench: Bench) -> None:
    assert measure(name, *bench) == read_facts()[name]
