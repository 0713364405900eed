"""Descriptions against MuJoCo's own view of the same file, and what happens to bad files."""

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from torc.errors import InputError, UnknownNameError
from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers
from torc.robots.loading import load_robot, robot_names
from torc.robots.schema import EXAMPLE

WriteRobot = Callable[..., Path]


def test_the_default_robot_is_shipped_under_its_name(robot: RobotDescription) -> None:
    assert robot.name in robot_names()
    assert robot.arm.dof == 7
    np.testing.assert_allclose(robot.arm.max_speed, np.deg2rad(60))
    np.testing.assert_allclose(robot.arm.max_acceleration, np.deg2rad(850))


def test_published_limits(robot: RobotDescription) -> None:
    degrees = [180, 110, 170, 135, 180, 110, 180]
    np.testing.assert_allclose(np.rad2deg(robot.arm.upper), degrees, atol=1e-4)
    np.testing.assert_allclose(robot.arm.lower, -robot.arm.upper)


def test_all_names_exist_in_the_mjcf(robot: RobotDescription) -> None:
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    for name in (*robot.arm_joint_names, *robot.gripper_joint_names):
        model.joint(name)
    for name in (*robot.arm_actuator_names, robot.gripper_actuator_name):
        model.actuator(name)
    for name in (robot.gripper_body_name, *robot.finger_body_names, *robot.root_body_names):
        model.body(name)
    for name in (*robot.pad_geom_names[0], *robot.pad_geom_names[1]):
        model.geom(name)
    for name in (*robot.tip_site_names, robot.tool0_site_name):
        model.site(name)


def test_everything_that_is_seen_is_in_a_rendered_group(robot: RobotDescription) -> None:
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    assert set(model.geom_group[~collides]) == {1}
    assert set(model.geom_group[collides]) == {3}


def test_rest_pose_touches_nothing(robot: RobotDescription) -> None:
    """Neither by MuJoCo's contacts nor by the padded spheres."""
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    for name, q in zip(robot.arm_joint_names, robot.arm.rest_qpos):
        data.joint(name).qpos = q
    mujoco.mj_forward(model, data)
    assert data.ncon == 0

    centers, spheres = sphere_centers(robot, robot.arm.rest_qpos[None], np.array([0.085]))[0], robot.spheres
    for i, j in robot.self_pairs:
        a, b = spheres.link == i, spheres.link == j
        gaps = np.linalg.norm(centers[a][:, None] - centers[b][None], axis=-1) - spheres.radii[b]
        assert (gaps - spheres.radii[a][:, None]).min() > 0.02
    moving = np.isin(spheres.link, robot.static_links)
    gaps = np.linalg.norm(centers[moving][:, None] - robot.static_spheres[None, :, :3], axis=-1)
    assert (gaps - spheres.radii[moving][:, None] - robot.static_spheres[:, 3]).min() > 0.01


def test_pairs_that_are_not_checked_cannot_touch(robot: RobotDescription, rng: np.random.Generator) -> None:
    """Neighbours apart; at random configurations, half of their joints at a limit."""
    arm, spheres = robot.arm, robot.spheres
    qpos = rng.uniform(arm.lower, arm.upper, (1500, 7))
    ends = np.where(rng.random(qpos.shape) < 0.5, arm.lower, arm.upper)
    qpos = np.where(rng.random(qpos.shape) < 0.5, ends, qpos)
    centers = sphere_centers(robot, qpos, rng.uniform(0, 0.085, len(qpos)))
    checked = {tuple(p) for p in robot.self_pairs.tolist()}
    for i in range(6):
        for j in range(i + 2, 10):
            if (i, j) in checked:
                continue
            a, b = np.flatnonzero(spheres.link == i), np.flatnonzero(spheres.link == j)
            gaps = np.linalg.norm(centers[:, a, None] - centers[:, None, b], axis=-1)
            assert (gaps - spheres.radii[a][:, None] - spheres.radii[b]).min() > 0.0, (i, j)


class TestAnotherRobot:
    def test_loads_from_its_files(self, write_other_robot: WriteRobot) -> None:
        other = load_robot(write_other_robot())
        assert other.arm.dof == 6
        np.testing.assert_allclose(np.rad2deg(other.arm.max_speed), [60, 90, 90, 90, 90, 90])
        assert other.gripper.ctrl(0.1) == pytest.approx(0.0, abs=1e-6)
        assert other.gripper.ctrl(0.0) == pytest.approx(250.0, abs=1e-6)
        # Both pads move by the same: the motor's force is shared between them.
        assert other.gripper.actuator_force(10.0, 0.05) == pytest.approx(20.0, rel=1e-6)
        np.testing.assert_allclose(other.gripper.T_tool0_tcp(0.03)[:3, 3], [0, 0, 0.1], atol=1e-9)
        assert len(other.static_spheres) > 0

    def test_default_self_pairs_leave_out_neighbours(self, write_other_robot: WriteRobot) -> None:
        pairs = load_robot(write_other_robot()).self_pairs.tolist()
        assert [0, 2] in pairs
        assert [0, 8] in pairs
        assert not any(p in pairs for p in ([0, 1], [5, 6], [5, 7], [6, 7], [7, 8]))

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("name: other", "nmae: other", "nmae"),
            ("name: other", 'name: "my\\tarm"', "name"),
            ("name: other", f"name: {'long' * 20}", "name"),
            ("torc-robot/1", "torc-robot/9", "format"),
            ("[a1, a2, a3, a4, a5, a6]", "[a1, a2, a3, a4, a5]", "actuators has 6"),
            ("[a1, a2, a3, a4, a5, a6]", "[a1, a2, a3, a4, a5, nose]", "'nose'"),
            ("[a1, a2, a3, a4, a5, a6]", "[a1, a3, a2, a4, a5, a6]", "joint"),
            ("driver_joint: slide_right", "driver_joint: slide_left", "slide_right"),
            ("max_width_m: 0.1", "max_width_m: 0.2", "max_width_m"),
            ("speed_deg_s: 90", "speed_deg_s: fast", "arm.speed_deg_s"),
            ("speed_deg_s: 90", "speed_deg_s: true", "arm.speed_deg_s: must be a number, not true or false"),
            ("rest_qpos_rad: [0,", "rest_qpos_rad: [9,", "rest_qpos_rad"),
            ("rest_qpos_rad: [0,", "rest_qpos_rad: [false,", "rest_qpos_rad.0: must be a number"),
            ("rest_qpos_rad: [0,", "rest_qpos_rad: [.nan,", "rest_qpos_rad.0: .*finite"),
            ("mjcf: other.xml", "mjcf: missing.xml", "missing.xml"),
            ("tool0_site: flange", "tool0_site: palm", "'palm'"),
            ("max_width_m: 0.1", "max_width_m: [", "Cannot read"),
        ],
    )
    def test_bad_files_are_named_with_their_fault(
        self, write_other_robot: WriteRobot, old: str, new: str, words: str
    ) -> None:
        with pytest.raises(InputError, match=words):
            load_robot(write_other_robot(old, new))

    @pytest.mark.parametrize("mask", ['contype="0" conaffinity="0"', 'contype="2" conaffinity="4"'])
    @pytest.mark.parametrize("part", ["pad", "blade"])
    def test_fingers_that_no_object_can_touch_are_refused(
        self, write_other_robot: WriteRobot, mask: str, part: str
    ) -> None:
        pad = '<geom name="right_pad" type="box" size="0.005 0.01 0.02" pos="0.005 0 0.02"'
        blade = '<geom name="right_blade" type="box" size="0.001 0.01 0.02" pos="0.011 0 0.02"'
        seen = f"{pad} {mask}/>" if part == "pad" else f"{pad}/>{blade} {mask}/>"
        path = write_other_robot(f"{pad}/>", seen, mjcf=True)
        if part == "blade":
            old = "pad_geoms: [right_pad]"
            path.write_text(path.read_text().replace(old, f"{old}, blade_geoms: [right_blade]"))
        with pytest.raises(InputError, match=f"'right_{part}'.*contype"):
            load_robot(path)

    def test_fingers_may_collide_by_either_mask(self, write_other_robot: WriteRobot) -> None:
        pad = 'size="0.005 0.01 0.02" pos="0.005 0 0.02"'
        assert (
            load_robot(write_other_robot(pad, f'{pad} contype="0" conaffinity="3"', mjcf=True)).arm.dof == 6
        )

    def test_a_joint_that_nobody_moves_is_an_error(self, write_other_robot: WriteRobot) -> None:
        stand = '<body name="stand"'
        lid = '<body name="lid"><joint/><geom size="1"/></body>' + stand
        with pytest.raises(InputError, match="lid"):
            load_robot(write_other_robot(stand, lid, mjcf=True))

    def test_mjcf_that_mujoco_refuses(self, write_other_robot: WriteRobot) -> None:
        with pytest.raises(InputError, match="MuJoCo cannot compile"):
            load_robot(write_other_robot("</mujoco>", "<nonsense/></mujoco>", mjcf=True))

    def test_unknown_name(self) -> None:
        with pytest.raises(UnknownNameError, match="sda10f_2f85"):
            load_robot("sda10f_2f58")

    def test_what_to_compare_with_is_there(self, write_other_robot: WriteRobot) -> None:
        for bad in ("sda10f_2f58", write_other_robot("name: other", "nmae: other")):
            with pytest.raises(InputError, match=re.escape(str(EXAMPLE))):
                load_robot(bad)
        assert load_robot(EXAMPLE).name in robot_names()


def test_nobody_can_change_the_shipped_robot_of_others():
    spoiled = load_robot()
    spoiled.arm.rest_qpos[:] = 9.0
    assert (load_robot().arm.rest_qpos < 9.0).all()


class TestRest:
    def test_parts_that_are_in_each_other_where_it_waits_are_named_with_the_remedy(
        self, write_other_robot: WriteRobot
    ) -> None:
        path = write_other_robot("never_with_static: [a1]", "never_with_static: []")
        with pytest.raises(
            InputError, match=r"'a1' moves touches the robot's fixed parts.*never_with_static"
        ):
            load_robot(path)
        folded = write_other_robot(
            "rest_qpos_rad: [0, 0.5, 0.5, 0.2, 0, 0]", "rest_qpos_rad: [0, 0, 2.5, 2.5, 0, 0]"
        )
        with pytest.raises(InputError, match=r"move touch each other.*self_collision\.pairs"):
            load_robot(folded)
