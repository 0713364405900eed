"""Objects come to rest, piles stay on the table, broken physics is noticed, and so is what moves, falls or creeps."""

import mujoco
import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, problem, row, standing, world_of

from torc.errors import PhysicsError
from torc.problems.problem import ObjectPlacement
from torc.sim.settling import EASED_M, StillnessConfig, dump, ease_apart, run, settle, watch_stillness
from torc.sim.simulated_world import Presence, build_world
from torc.sim.stepping import Watchdog, greatest_depth
from torc.workspace.workspace_files import load_workspace

KINDS = ("soup_can_red", "mug_red", "apple_red", "bowl_blue", "cracker_box_red", "tuna_can_blue")


def test_a_ball_at_the_edge_rolls_off_and_is_reported():
    edge = load_workspace().table.center[0] + load_workspace().table.size[0] / 2
    ball = standing("ball", "apple_red", edge + 0.01, 0.0)
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0), ball)
    report = settle(world)
    assert report.settled
    assert report.left == (1,)


def test_a_pile_stays_on_the_table_and_repeats(rng):
    pile = problem(*row(*KINDS, *KINDS))
    first, report = dump(pile, load_workspace(), np.random.default_rng(3))
    second, _ = dump(pile, load_workspace(), np.random.default_rng(3))
    other, _ = dump(pile, load_workspace(), rng)
    assert len(report.left) <= 1
    assert first == second
    assert first != other


@pytest.mark.parametrize(
    ("other", "named"),
    [
        (("anvil", (0.67, -0.1, TABLE_Z + 0.1)), r"object 0 \(a\) and object 1 \(b\) are"),
        (("soup_can_red", (0.55, 0.2, TABLE_Z - 0.01)), r"object 1 \(b\) and table are 60 mm"),
    ],
)
def test_what_is_placed_inside_something_is_named_with_the_remedy(other, named):
    world = world_of(
        ObjectPlacement("a", "anvil", (0.65, -0.1, TABLE_Z + 0.1), UPRIGHT),
        ObjectPlacement("b", *other, UPRIGHT),
    )
    with pytest.raises(PhysicsError, match=f"{named}.*inside each other.*move them apart.*z = 1.05 m"):
        run(world, 0.5)


def test_being_pressed_together_is_noticed():
    world = world_of(standing("carton", "carton", 0.6, 0.0))
    body = world.object_bodies[0]
    for force in range(0, 1650, 50):  # little by little: it sinks in and stays there
        world.data.xfrc_applied[body, 2] = -force
        run(world, 0.02)
    with pytest.raises(PhysicsError, match=r"table and object 0 \(carton\) are [12]\d mm"):
        run(world, 0.2, check_s=0.01)


def test_thin_things_that_mujoco_thinks_deep_in_each_other_pass():
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0), standing("other", "soup_can_red", 0.6, 0.2))
    run(world, 0.1)
    world.data.contact.dist[0] = -0.08
    Watchdog(world).check()


def test_no_two_boxes_are_deeper_in_each_other_than_said(rng):
    bodies = "".join(
        f"<body><freejoint/><geom type='box' size='{a} {b} {c}'/></body>"
        for a, b, c in ((0.05, 0.002, 0.03), (0.04, 0.03, 0.02))
    )
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    data, geoms, touching = mujoco.MjData(model), np.arange(2), 0
    for _ in range(300):
        data.qpos[:] = rng.normal(scale=np.tile([0.02] * 3 + [1.0] * 4, 2))
        mujoco.mj_kinematics(model, data)
        depth = -mujoco.mj_geomDistance(model, data, 0, 1, 1.0, None)
        bound = greatest_depth(model, data, geoms)
        assert bound > depth - 1e-6
        if depth > 0:
            # Separating axes are exact for boxes.
            assert bound == pytest.approx(depth, abs=1e-5)
            touching += 1
    assert touching > 50


def test_an_explosion_is_noticed():
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0))
    world.data.qvel[:3] = [0.0, 0.0, 9.0]
    with pytest.raises(PhysicsError, match=r"Object 0 \(can\) moves at 9\.\d m/s.*torc problems validate"):
        Watchdog(world).check()


def test_nan_is_noticed():
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0))
    world.data.qvel[0] = np.nan
    with pytest.raises(PhysicsError, match=r"diverged.*torc problems validate"):
        run(world, 0.1)


def test_light_things_do_not_sink_in_under_a_finger():
    world = world_of(standing("sponge", "sponge_blue", 0.6, 0.0))
    body = world.object_bodies[0]
    for force in range(0, 42, 2):
        world.data.xfrc_applied[body, 2] = -force
        run(world, 0.02)
    assert world.data.contact.dist.min() > -0.005


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
