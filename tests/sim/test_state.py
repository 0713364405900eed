"""Saved states restore every bit of the future."""

import mujoco
import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, problem, row, standing, world_of

from torc.errors import InputError
from torc.problems.problem import Problem
from torc.records import BACKGROUND, ROBOT
from torc.robots.kinematics import tool0_poses
from torc.robots.loading import load_robot
from torc.sim.rendering import CameraRenderer
from torc.sim.simulated_world import Presence, build_world, restore_state, save_state
from torc.workspace.workspace_files import load_workspace


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


def test_the_target_is_object_zero():
    objects = row("mug_red", "apple_red", "bowl_blue")
    chosen = Problem("test", "structured", "", objects[2].name, objects)
    world = build_world(chosen, None, load_workspace())
    assert [m.name for m in world.models] == ["bowl_blue", "mug_red", "apple_red"]
    assert np.allclose(world.positions[0], objects[2].position)
    assert np.allclose(world.positions[1:], [o.position for o in objects[:2]])


def test_every_geom_is_labelled():
    world = world_of(*row("mug_red", "apple_red"), robot=load_robot())
    assert set(np.unique(world.geom_labels)) == {ROBOT, BACKGROUND, 0, 1}
    robot_bodies = {world.model.body(b).name for b in world.model.geom_bodyid[world.geom_labels == ROBOT]}
    assert "world" not in robot_bodies
    table = world.model.geom("table").id
    assert world.geom_labels[table] == BACKGROUND


def test_the_arm_starts_at_rest_where_kinematics_says():
    robot = load_robot()
    world = world_of(standing("mug", "mug_red", 0.6, 0.0), robot=robot)
    world.update_kinematics()
    tool0 = world.data.site(robot.tool0_site_name)
    expected = tool0_poses(robot.arm, robot.arm.rest_qpos[None])[0]
    assert np.allclose(tool0.xpos, expected[:3, 3], atol=1e-6)
    assert np.allclose(tool0.xmat.reshape(3, 3), expected[:3, :3], atol=1e-6)


def test_who_is_on_the_table_and_in_the_bin():
    world = world_of(*row("mug_red", "apple_red", "bowl_blue", "soup_can_red"))
    bin_ = load_workspace().bin
    world.set_object_pose(1, np.add(bin_.center, [0, 0, 0.05]), np.array(UPRIGHT))
    world.set_object_pose(2, np.array([0.6, 0.0, TABLE_Z - 0.3]), np.array(UPRIGHT))
    assert world.on_table() == (0, 3)
    assert world.in_bin() == (1,)
    world.park(3, Presence.DELIVERED)
    world.park(1, Presence.DELIVERED)
    assert world.on_table() == (0,)
    assert world.in_bin() == ()


def test_too_many_objects_are_refused():
    with pytest.raises(InputError, match="at most 64"):
        build_world(
            problem(*[standing(f"o{i}", "mug_red", 0.6, 0.0) for i in range(65)]), None, load_workspace()
        )
