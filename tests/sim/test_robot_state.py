"""A robot that goes on from a saved state does what it would have done, to the last bit."""

import numpy as np
import pytest
from sim_scenes import row, world_of
from test_robot import ROBOT, plan_for

from torc.records import PickResult
from torc.sim.robot import SimulatedRobot
from torc.sim.simulated_world import Presence


def _same(a, b):
    return np.array_equal(a.world, b.world) and (a.grip, a.stepper) == (b.grip, b.stepper)


@pytest.fixture
def objects():
    return row("carton", "soup_can_red", "mug_red")


@pytest.fixture
def robot(objects):
    return SimulatedRobot(world_of(*objects, robot=ROBOT))


def test_a_pick_from_a_restored_state_is_the_same_pick_whatever_was_done_in_between(robot, objects):
    robot.execute(plan_for(robot.world, 1))
    saved, plan = robot.save(), plan_for(robot.world, 0)
    outcome = robot.execute(plan)
    after = robot.save()
    other = SimulatedRobot(world_of(*objects, robot=ROBOT))
    other.execute(plan_for(other.world, 2))
    for again in (robot, other):
        again.restore(saved)
        assert _same(again.save(), saved)
        assert again.execute(plan) == outcome
        assert _same(again.save(), after)


def test_removed_objects_are_gone_and_what_they_carried_comes_down(robot):
    world = robot.world
    top = world.positions[0] + np.array([0, 0, 0.14])
    world.set_object_pose(1, top, np.array([1.0, 0, 0, 0]))
    robot.remove([0])
    assert world.presence.tolist() == [Presence.DELIVERED, Presence.PRESENT, Presence.PRESENT]
    assert world.positions[1, 2] < top[2] - 0.05
    assert world.speeds().max() < 0.1
    assert robot.execute(plan_for(world, 2)).result is not PickResult.RETRIEVED
