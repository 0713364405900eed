"""Objects come to rest, piles stay on the table, and broken physics is noticed."""

import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, problem, row, standing, world_of

from torc.errors import PhysicsError
from torc.problems.problem import ObjectPlacement, load_problem
from torc.sim.settling import COARSE, UNSEEN, SettleConfig, dump, run, settle, settle_problem
from torc.sim.stillness import StillnessConfig, watch_stillness
from torc.sim.watchdog import Watchdog
from torc.sim.world import build_world
from torc.workspace.files import load_workspace

KINDS = ("soup_can_red", "mug_red", "apple_red", "bowl_blue", "cracker_box_red", "tuna_can_blue")


def test_standing_objects_settle_where_they_stand():
    world = world_of(*row(*KINDS))
    before = world.positions
    report = settle(world)
    assert report.settled
    assert report.left == ()
    assert report.max_speed_m_s < SettleConfig().speed_m_s
    assert np.abs(world.positions - before).max() < 0.005


@pytest.mark.parametrize("name", ["validation-unstructured-02", "validation-unstructured-04"])
def test_a_pile_creeps_no_less_in_coarse_steps(name):
    moved = []
    for config in (UNSEEN, COARSE):
        world = build_world(load_problem(name), None, load_workspace(), config)
        report = watch_stillness(world, StillnessConfig(1.0, 1.0, seconds=4.0))
        moved.append((report.distance_m, report.angle_rad))
    assert world.model.opt.timestep == pytest.approx(0.004)
    (fine_m, fine_rad), (coarse_m, coarse_rad) = moved
    assert coarse_m == pytest.approx(fine_m, rel=0.3)
    assert coarse_rad == pytest.approx(fine_rad, rel=0.3)


def test_a_ball_at_the_edge_rolls_off_and_is_reported():
    edge = load_workspace().table.center[0] + load_workspace().table.size[0] / 2
    ball = standing("ball", "apple_red", edge + 0.01, 0.0)
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0), ball)
    report = settle(world)
    assert report.settled
    assert report.left == (1,)


@pytest.mark.parametrize("config", [UNSEEN, COARSE])
def test_the_time_that_is_told_is_the_simulated_one(config):
    world = build_world(problem(*row("mug_red", "apple_red")), None, load_workspace(), config)
    settled_s = settle(world).duration_s
    assert settled_s == pytest.approx(world.time_s)
    watched_s = watch_stillness(world, StillnessConfig(seconds=1.0)).watched_s
    assert settled_s + watched_s == pytest.approx(world.time_s)


def test_settled_poses_keep_the_order_of_the_file():
    objects = row("mug_red", "apple_red", "bowl_blue")
    reordered = problem(objects[1], objects[0], objects[2])
    settled, _ = settle_problem(reordered, load_workspace())
    assert [o.name for o in settled.objects] == [o.name for o in reordered.objects]
    for before, after in zip(reordered.objects, settled.objects):
        assert np.allclose(before.position, after.position, atol=5e-3)


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


def test_falling_off_the_table_is_not_an_explosion():
    world = world_of(standing("can", "soup_can_red", 0.6, 0.0))
    world.set_object_pose(0, np.array([0.6, 1.2, 1.9]), np.array(UPRIGHT))
    run(world, 0.75)  # 5.9 m/s at the floor
    assert world.positions[0, 2] < 0.2
    assert world.on_table() == ()


def test_light_things_do_not_sink_in_under_a_finger():
    world = world_of(standing("sponge", "sponge_blue", 0.6, 0.0))
    body = world.object_bodies[0]
    for force in range(0, 42, 2):
        world.data.xfrc_applied[body, 2] = -force
        run(world, 0.02)
    assert world.data.contact.dist.min() > -0.005
