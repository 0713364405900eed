"""The world is what the problem says, under the right ids."""

import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, problem, row, standing, world_of

from torc.errors import InputError
from torc.problems.problem import Problem
from torc.records import BACKGROUND, ROBOT
from torc.robots.kinematics import tool0_poses
from torc.robots.loading import load_robot
from torc.sim.world import Presence, build_world
from torc.workspace.files import load_workspace


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
