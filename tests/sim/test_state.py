"""Saved states restore every bit of the future."""

import mujoco
import numpy as np
import pytest
from sim_scenes import row, world_of

from torc.errors import InputError
from torc.robots.loading import load_robot
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


@pytest.mark.parametrize("steps", [5, 1000])
def test_what_sleeps_goes_on_sleeping_and_the_future_is_the_same_in_any_world(world, steps):
    saved = _run(world, steps)
    asleep = world.data.tree_asleep.copy()
    assert (asleep >= 0).any() == (steps == 1000)
    _run(world, 7)
    restore_state(world, saved)
    assert np.array_equal(world.data.tree_asleep, asleep)
    assert np.array_equal(save_state(world), saved)
    other = world_of(*row("soup_can_red", "mug_red", "apple_red"), robot=load_robot())
    restore_state(other, saved)
    assert np.array_equal(_run(other), _run(world))


def test_what_is_derived_from_sleep_is_as_mujoco_derives_it(world):
    names = ("tree_awake", "body_awake", "ntree_awake", "nbody_awake", "nparent_awake", "nv_awake")
    lists = {
        "body_awake_ind": "nbody_awake",
        "parent_awake_ind": "nparent_awake",
        "dof_awake_ind": "nv_awake",
    }

    def derived():
        facts = {name: np.copy(getattr(world.data, name)) for name in names}
        return facts | {n: getattr(world.data, n)[: getattr(world.data, k)].copy() for n, k in lists.items()}

    saved = _run(world, 1000)
    as_run = derived()
    assert 0 < as_run["ntree_awake"] < world.model.ntree
    restore_state(world, saved)
    for name, values in derived().items():
        assert np.array_equal(values, as_run[name]), name


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


def test_a_foreign_state_is_refused(world):
    with pytest.raises(InputError, match="other objects"):
        restore_state(world, save_state(world)[:-1])
