"""A kernel is compiled for one kind of arguments, and none is compiled once a rehearsal is over."""

import json
import os
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.kernels import all_signatures, compiled_since
from torc.collision.collision_world import build_collision_world
from torc.collision.contacts import collides
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.validity import evaluate_grasps, evaluate_grasps_without_robot
from torc.motion.config import MotionConfig
from torc.motion.mover import Mover
from torc.occlusion.volume import FIXED_CAMERA, empty_volume, update_volume
from torc.robots.ik import solve_ik
from torc.task_planning.relations import find_relations
from torc.testing import contexts
from torc.testing.synthetic import random_clutter, synthetic_capture

UNUSED = [
    *(f"torc.robots.ik.{name}" for name in ("_descend", "numeric_ik_kernel")),
    "torc.task_planning.belief.box_kernels._voxel",
    *(f"torc.task_planning.path_kernels.{name}" for name in ("_lowest", "_popcount", "_signed")),
]
"""Kernels for arms without a closed form of their inverse kinematics; and those that are copied into others."""


def odd(value):
    """The same record or array in another memory order, and read-only."""
    if is_dataclass(value):
        return replace(value, **{f.name: odd(getattr(value, f.name)) for f in fields(value)})
    if not isinstance(value, np.ndarray):
        return value
    out = np.asfortranarray(value).copy(order="K")
    out.flags.writeable = False
    return out


def see(capture, robot, workspace, change):
    """All that is made of a snapshot, each record passed on through `change`."""
    scene = change(contexts.see(change(capture)))
    volume = update_volume(empty_volume(workspace.grid), scene, FIXED_CAMERA)
    volume = change(update_volume(volume, scene, FIXED_CAMERA))
    world = build_collision_world(volume, workspace)
    planner = GeometricGraspPlanner(robot.gripper, workspace.support_z_m)
    grasps = change(planner.plan(scene, volume, np.random.default_rng(0)))
    report = evaluate_grasps(grasps, scene, world, robot)
    alone = evaluate_grasps_without_robot(grasps, scene, world, robot.gripper)
    q = change(report.qpos[np.isfinite(report.qpos[:, 0])])
    poses = change(grasps.Ts_world_tcp)
    return (
        world.kind,
        grasps.scores,
        report.status,
        alone.status,
        solve_ik(robot.arm, poses[:1]).count,
        collides(world, robot, q, 0.05),
        collides(world, robot, q[:1], 0.05),
        Mover(robot, MotionConfig()).space(world, 0.05).edges_collide(q[0], q[1:2]),
        np.array([(r.source, r.target) for r in find_relations(scene)]),
    )


def test_memory_order_and_protection_change_neither_results_nor_what_is_compiled(robot, workspace):
    capture = synthetic_capture(random_clutter(np.random.default_rng(0), 6), workspace.camera)
    plain = see(capture, robot, workspace, lambda value: value)
    before = all_signatures()
    for a, b in zip(plain, see(capture, robot, workspace, odd), strict=True):
        np.testing.assert_array_equal(a, b)
    assert compiled_since(before) == []


@pytest.mark.slow
def test_nothing_is_compiled_after_a_rehearsal(tmp_path):
    """From an empty cache: then whole trials, clean and with noise, and a decision on a frame from a file."""
    trials = ["structured-01,dg-select,clean", "unstructured-03,random,clean", "unstructured-03,random,noise"]
    run = subprocess.run(
        [sys.executable, "-m", "tests.kernels_script", tmp_path, *trials],
        cwd=Path(__file__).parents[1],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout)
    assert found["played"] == []
    assert found["decided"] == []
    assert found["announced"] == []
    assert found["never"] == UNUSED


@pytest.mark.slow
def test_warming_up_compiles_every_kernel_of_the_shipped_parts(tmp_path):
    script = (
        "from contextlib import suppress\n"
        "from tests.helpers.kernels import all_signatures\n"
        "from torc.cli.main import main\n"
        "with suppress(SystemExit): main(['warm-up'])\n"
        "print(*sorted(name for name, signatures in all_signatures().items() if not signatures))"
    )
    run = subprocess.run(
        [sys.executable, "-c", script],
        cwd=Path(__file__).parents[1],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    assert set(run.stdout.splitlines()[-1].split()) <= set(UNUSED)
