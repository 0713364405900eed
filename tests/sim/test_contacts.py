"""What is carried, directly and through others; how hard the robot presses."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, standing, world_of

from torc.problems.problem import ObjectPlacement
from torc.robots.loading import load_robot
from torc.sim.contacts import ContactReader, deepest_overlap, lies_on
from torc.sim.robot import _choose_held
from torc.sim.settling import settle
from torc.sim.simulated_world import Presence, save_state

ROBOT = load_robot()


@pytest.fixture
def stacked():
    """A carton between the open fingers' place, another on top of it, a third on the table far away."""
    world = world_of(
        standing("low", "carton", 0.6, -0.1),
        standing("high", "carton", 0.6, -0.1),
        standing("far", "carton", 0.75, 0.2),
        robot=ROBOT,
    )
    tip = np.mean([world.data.site(n).xpos for n in ROBOT.tip_site_names], axis=0)
    half = world.models[0].size_m[2] / 2
    # The lower one's side sinks 1 mm into a fingertip; both hang in the air.
    finger = world.data.site(ROBOT.tip_site_names[1]).xpos
    offset = (finger - tip) / np.linalg.norm(finger - tip)
    center = finger - offset * (world.models[0].size_m[0] / 2 - 0.001)
    world.set_object_pose(0, center, np.array(UPRIGHT))
    world.set_object_pose(1, center + np.array([0, 0, 2 * half - 0.001]), np.array(UPRIGHT))
    world.update_position_stage()
    return world


def test_carried_directly_and_through_another(stacked):
    before = np.full(3, TABLE_Z)
    before[2] = stacked.positions[2, 2]
    assert ContactReader(stacked, ROBOT).carried(before, 0.02) == {0: True, 1: False}


def test_force_on_the_robot_names_the_thing(stacked):
    reader = ContactReader(stacked, ROBOT)
    mujoco.mj_step(stacked.model, stacked.data)
    force, words = reader.hardest(ignore_gripped=False)
    assert force > 0
    assert "object 0 (low)" in words
    assert "gripper" in words
    assert reader.hardest(ignore_gripped=True) == (0.0, "")


@pytest.mark.parametrize(
    ("carried", "delivered", "wanted", "held"),
    [
        ({3: True, 5: False}, set(), 5, 5),
        ({3: True, 0: False}, set(), 5, 0),
        ({5: False, 0: False}, {0, 5}, 5, 0),
        ({5: False, 7: True}, {7}, 1, 7),
        ({}, set(), 0, None),
    ],
)
def test_which_of_several_counts(carried, delivered, wanted, held):
    assert _choose_held(carried, delivered, wanted) == held


def test_the_deepest_overlap_is_measured_and_named():
    apart = world_of(standing("can", "soup_can_red", 0.60, 0.0), standing("cup", "mug_red", 0.60, 0.3))
    apart.data.qpos[2] += 0.1
    apart.data.qpos[9] += 0.1
    assert deepest_overlap(apart).depth_m <= 0.0
    sunk = world_of(standing("can", "soup_can_red", 0.60, 0.0), standing("cup", "mug_red", 0.60, 0.3))
    sunk.data.qpos[2] -= 0.006  # it was 1 mm above the table
    overlap = deepest_overlap(sunk)
    assert overlap.depth_m == pytest.approx(0.005, abs=1e-6)
    assert any("can" in name for name in overlap.between)
    assert "table" in overlap.between
    assert overlap.object_ids == (0,)
    assert deepest_overlap(apart).object_ids == ()


def _on(name: str, model: str, x: float, y: float, height: float) -> ObjectPlacement:
    below = standing(name, model, x, y)
    return replace(below, position=(x, y, below.position[2] + height))


def test_who_lies_on_whom_in_a_stack_and_not_beside_it():
    world = world_of(
        standing("bottom", "anvil", 0.60, -0.10),
        _on("middle", "carton", 0.58, -0.10, 0.202),
        _on("top", "carton", 0.58, -0.10, 0.344),
        standing("beside", "carton", 0.60, -0.011),
        standing("far", "carton", 0.75, 0.2),
    )
    mujoco.mj_step(world.model, world.data, 8)  # about to touch down
    before = save_state(world)
    lies_on(world)
    assert np.array_equal(before, save_state(world))
    assert settle(world).settled
    assert lies_on(world) == {(1, 0), (2, 1)}
    world = world_of(*world.problem.objects, robot=ROBOT)
    mujoco.mj_step(world.model, world.data, 1500)
    assert (world.data.tree_asleep >= 0).any()
    asleep = save_state(world)
    assert lies_on(world) == {(1, 0), (2, 1)}
    assert np.array_equal(asleep, save_state(world))
    world.park(1, Presence.DELIVERED)
    world.park(2, Presence.DELIVERED)
    assert lies_on(world) == frozenset()
