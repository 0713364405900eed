"""What moves is noticed, whether it falls, rolls or creeps; what stays is left alone, and may be told early."""

import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, problem, standing, world_of

from torc.problems.problem import ObjectPlacement
from torc.sim.settling import EASED_M, StillnessConfig, ease_apart, settle, watch_stillness
from torc.sim.simulated_world import Presence, build_world
from torc.workspace.workspace_files import load_workspace

STANDING = ("soup_can_red", "mug_red", "cracker_box_red")


def _settled(*placements):
    world = world_of(*placements)
    settle(world)
    return world


def test_a_slow_topple_is_seen_at_once_and_named():
    # On its edge and past the tipping point by a hair: settle's speed limit alone would not see it for a while.
    half = np.deg2rad(68.3) / 2
    leaning = ObjectPlacement(
        "box", "cracker_box_red", (0.65, 0.0, 1.142), (np.cos(half), 0.0, np.sin(half), 0.0)
    )
    report = watch_stillness(world_of(standing("can", "soup_can_red", 0.55, -0.2), leaning))
    assert not report.still
    assert report.watched_s < 5.0
    assert np.argmax(report.angles_rad) == 1


@pytest.mark.parametrize(("speed_mm_s", "still"), [(0.6, False), (0.3, True), (0.1, True)])
def test_a_steady_creep_is_followed_to_the_end_where_it_comes_near_the_limit(speed_mm_s, still):
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0))
    world.model.opt.gravity[:] = 0.0  # afloat: nothing brakes it
    world.data.qpos[2] += 0.1
    world.data.qvel[0] = speed_mm_s / 1000
    report = watch_stillness(world, StillnessConfig(seconds=4.0, early_s=1.0))
    assert report.still == still
    assert report.watched_s == pytest.approx({0.6: 3.5, 0.3: 2.75, 0.1: 1.0}[speed_mm_s])
    assert report.distance_m == pytest.approx(report.watched_s * speed_mm_s / 1000, rel=0.01)


def test_what_leaves_the_table_is_reported_and_what_was_gone_does_not_count():
    edge = load_workspace().table.center[0] + load_workspace().table.size[0] / 2
    ball = standing("ball", "apple_red", edge + 0.01, 0.0)
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0), ball, standing("gone", "mug_red", 0.8, 0.1))
    world.park(2, Presence.DROPPED)
    report = watch_stillness(world, StillnessConfig(distance_m=10.0, angle_rad=10.0, seconds=2.0))
    assert not report.still
    assert report.left == (1,)
    assert report.distances_m[2] == 0.0


def _overlapping(depth_m: float):
    """Two cans side by side, one pushed into the other, and one sunk into the table."""
    radius = 0.033
    z = TABLE_Z + 0.0515
    cans = (
        ObjectPlacement("a", "soup_can_red", (0.60, -0.10, z), UPRIGHT),
        ObjectPlacement("b", "soup_can_red", (0.60, -0.10 + 2 * radius - depth_m, z), UPRIGHT),
        ObjectPlacement("c", "soup_can_red", (0.75, -0.10, z - depth_m), UPRIGHT),
    )
    return build_world(problem(*cans), None, load_workspace())


def test_overlapping_cans_come_apart_and_keep_standing():
    world = _overlapping(0.02)
    before = world.positions
    before_m, after_m = ease_apart(world)
    assert before_m > 0.015
    assert after_m <= EASED_M
    assert np.abs(world.velocities).max() == 0.0
    moved = np.linalg.norm(world.positions - before, axis=1)
    assert moved.max() < 0.03
    assert settle(world).settled
    upright = 1 - 2 * (world.wxyz[:, 1] ** 2 + world.wxyz[:, 2] ** 2)
    assert upright.min() > 0.99
