"""Saved states restore every bit of the future."""

import mujoco
import numpy as np
import pytest
from sim_scenes import row, world_of

from torc.errors import InputError
from torc.robots.description import load_robot
from torc.sim.rendering import CameraRenderer
from torc.sim.state import restore_state, save_state
from torc.sim.world import Presence


def _run(world, steps=200):
    mujoco.mj_step(world.model, world.data, nstep=steps)
    return save_state(world)


@pytest.fixture
def world():
    world = world_of(*row("soup_can_red", "mug_red", "apple_red"), robot=load_robot())
    world.data.ctrl[:7] += 0.2  # the arm swings meanwhile
    return world


def test_running_on_from_a_restored_state_is_identical(world):
    _run(world)
    saved = save_state(world)
    first = _run(world)
    restore_state(world, saved)
    assert np.array_equal(_run(world), first)


def test_a_state_restores_into_a_world_built_alike(world):
    saved = _run(world)
    other = world_of(*row("soup_can_red", "mug_red", "apple_red"), robot=load_robot())
    restore_state(other, saved)
    assert np.array_equal(save_state(other), saved)
    assert np.array_equal(_run(other), _run(world))


def test_two_worlds_built_alike_have_the_same_future():
    objects = row("soup_can_red", "mug_red", "apple_red")
    assert np.array_equal(_run(world_of(*objects)), _run(world_of(*objects)))


def test_looking_does_not_change_the_future(world):
    saved = save_state(world)
    blind = [_run(world, 20) for _ in range(5)][-1]
    restore_state(world, saved)
    with CameraRenderer(world, world.workspace.camera) as renderer:
        for _ in range(5):
            seeing = _run(world, 20)
            renderer.render()
    assert np.array_equal(blind, seeing)


def test_parked_objects_stay_parked_and_are_restored(world):
    saved = save_state(world)
    world.park(1, Presence.DELIVERED)
    parked = save_state(world)
    spot = world.positions[1].copy()
    _run(world, 1000)
    assert np.allclose(world.positions[1], spot, atol=1e-9)
    restore_state(world, saved)
    assert world.present.all()
    restore_state(world, parked)
    assert world.presence.tolist() == [0, int(Presence.DELIVERED), 0]
    assert 1 not in world.on_table()


def test_unparking_brings_weight_back(world):
    position, wxyz = world.positions[1].copy(), world.wxyz[1].copy()
    world.park(1, Presence.DROPPED)
    world.unpark(1, position + np.array([0, 0, 0.2]), wxyz)
    _run(world, 300)
    assert world.positions[1][2] == pytest.approx(position[2], abs=0.003)


def test_a_foreign_state_is_refused(world):
    with pytest.raises(InputError, match="other objects"):
        restore_state(world, save_state(world)[:-1])
