"""The world is what the problem says, under the right ids."""

import shutil

import mujoco
import numpy as np
import pytest
from sim_scenes import TABLE_Z, UPRIGHT, problem, row, standing, world_of

from torc.errors import InputError
from torc.problems.problem import Problem
from torc.records import BACKGROUND, ROBOT
from torc.robots.kinematics import tool0_poses
from torc.robots.loading import load_robot
from torc.robots.schema import EXAMPLE
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


def test_what_a_robot_file_presets_holds_for_the_robot_alone(tmp_path, caplog, recwarn):
    presets = """
      <option gravity="0 0 1" density="1000" viscosity="5" timestep="0.1"><flag contact="disable"/></option>
      <default><geom group="3" margin="0.1" friction="0.01" rgba="1 0 0 1"/><joint damping="9"/></default>
      <keyframe><key name="home" qpos="QPOS"/></keyframe>
    """
    shutil.copytree(EXAMPLE.parent, tmp_path, dirs_exist_ok=True)
    mjcf = load_robot(tmp_path / EXAMPLE.name).mjcf_path
    qpos = " ".join(["0.1"] * mujoco.MjModel.from_xml_path(str(mjcf)).nq)
    tag = '<mujoco model="sda10f_2f85">'
    mjcf.write_text(mjcf.read_text().replace(tag, tag + presets.replace("QPOS", qpos), 1))
    plain, preset = (
        world_of(*row("mug_red", "apple_red"), robot=load_robot(path))
        for path in (EXAMPLE, tmp_path / EXAMPLE.name)
    )
    ours = plain.geom_labels != ROBOT
    assert np.array_equal(preset.geom_labels, plain.geom_labels)
    for name in ("group", "contype", "margin", "friction", "condim", "solref", "rgba"):
        values = [getattr(world.model, f"geom_{name}")[ours] for world in (plain, preset)]
        assert np.array_equal(*values), name
    for name in ("body_mass", "body_inertia", "dof_damping"):
        at = slice(-12, None) if name.startswith("dof") else plain.object_bodies
        assert np.array_equal(getattr(plain.model, name)[at], getattr(preset.model, name)[at]), name
    for name in ("timestep", "gravity", "density", "viscosity", "disableflags", "enableflags", "integrator"):
        assert np.array_equal(getattr(plain.model.opt, name), getattr(preset.model.opt, name)), name
    assert not caplog.records
    assert not recwarn.list


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


def test_bad_requests_are_refused():
    world = world_of(standing("mug", "mug_red", 0.6, 0.0))
    with pytest.raises(InputError, match="no object 1"):
        world.set_object_pose(1, np.zeros(3), np.array(UPRIGHT))
    with pytest.raises(InputError, match="zero quaternion"):
        world.set_object_pose(0, np.zeros(3), np.zeros(4))
    with pytest.raises(InputError, match="at most 64"):
        build_world(
            problem(*[standing(f"o{i}", "mug_red", 0.6, 0.0) for i in range(65)]), None, load_workspace()
        )
