"""Descriptions against MuJoCo's own view of the same file, and what happens to bad files."""

import os
import shutil

import numpy as np
import pytest
from PIL import Image

from torc.errors import InputError, UnknownNameError
from torc.robots.kinematics import sphere_centers
from torc.robots.loading import load_robot, own_source
from torc.robots.names import DEFAULT_ROBOT


def test_pairs_that_are_not_checked_cannot_touch(robot, rng):
    """Neighbours apart; at random configurations, half of their joints at a limit."""
    arm, spheres, dof = robot.arm, robot.spheres, robot.arm.dof
    qpos = rng.uniform(arm.lower, arm.upper, (1500, dof))
    ends = np.where(rng.random(qpos.shape) < 0.5, arm.lower, arm.upper)
    qpos = np.where(rng.random(qpos.shape) < 0.5, ends, qpos)
    centers = sphere_centers(robot, qpos, rng.uniform(0, robot.gripper.max_width_m, len(qpos)))
    checked = {tuple(p) for p in robot.self_pairs.tolist()}
    for i in range(dof - 1):
        for j in range(i + 2, dof + 3):
            if (i, j) in checked:
                continue
            a, b = np.flatnonzero(spheres.link == i), np.flatnonzero(spheres.link == j)
            gaps = np.linalg.norm(centers[:, a, None] - centers[:, None, b], axis=-1)
            assert (gaps - spheres.radii[a][:, None] - spheres.radii[b]).min() > 0.0, (i, j)


def test_links_that_are_not_checked_against_the_fixed_parts_cannot_touch_them_or_always_do(robot, rng):
    if robot.name == DEFAULT_ROBOT:
        pytest.skip("its second link may come near to its shoulder; the MJCF excludes that contact, too")
    arm, spheres, static = robot.arm, robot.spheres, robot.static_spheres
    centers = sphere_centers(robot, rng.uniform(arm.lower, arm.upper, (1500, arm.dof)), np.zeros(1500))
    for link in sorted(set(range(arm.dof + 3)) - set(robot.static_links)):
        own = spheres.link == link
        gaps = np.linalg.norm(centers[:, own, None] - static[:, :3], axis=-1)
        touches = (gaps - spheres.radii[own][:, None] - static[:, 3]).min(axis=(1, 2)) < 0
        assert touches.mean() in (0.0, 1.0), link


class TestAnotherRobot:
    def test_loads_from_its_files(self, write_other_robot):
        other = load_robot(write_other_robot())
        assert other.arm.dof == 6
        np.testing.assert_allclose(np.rad2deg(other.arm.max_speed), [60, 90, 90, 90, 90, 90])
        assert other.gripper.ctrl(0.1) == pytest.approx(0.0, abs=1e-6)
        assert other.gripper.ctrl(0.0) == pytest.approx(250.0, abs=1e-6)
        # Both pads move by the same: the motor's force is shared between them.
        assert other.gripper.actuator_force(10.0, 0.05) == pytest.approx(20.0, rel=1e-6)
        np.testing.assert_allclose(other.gripper.T_tool0_tcp(0.03)[:3, 3], [0, 0, 0.1], atol=1e-9)
        assert len(other.static_spheres) > 0

    def test_default_self_pairs_leave_out_neighbours(self, write_other_robot):
        pairs = load_robot(write_other_robot()).self_pairs.tolist()
        assert [0, 2] in pairs
        assert [0, 8] in pairs
        assert not any(p in pairs for p in ([0, 1], [5, 6], [5, 7], [6, 7], [7, 8]))

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("name: other", "nmae: other", "nmae"),
            ("name: other", 'name: "my\\tarm"', "name"),
            ("torc-robot/1", "torc-robot/9", "format"),
            ("[a1, a2, a3, a4, a5, a6]", "[a1, a2, a3, a4, a5]", "actuators has 6"),
            ("[a1, a2, a3, a4, a5, a6]", "[a1, a2, a3, a4, a5, nose]", "'nose'"),
            ("[a1, a2, a3, a4, a5, a6]", "[a1, a3, a2, a4, a5, a6]", "joint"),
            ("driver_joint: slide_right", "driver_joint: slide_left", "slide_right"),
            ("max_width_m: 0.1", "max_width_m: 0.2", "max_width_m"),
            ("speed_deg_s: 90", "speed_deg_s: fast", "arm.speed_deg_s"),
            ("rest_qpos_rad: [0,", "rest_qpos_rad: [9,", "rest_qpos_rad"),
            ("rest_qpos_rad: [0,", "rest_qpos_rad: [.nan,", "rest_qpos_rad.0.: .*finite"),
            ("mjcf: other.xml", "mjcf: missing.xml", "missing.xml"),
            ("tool0_site: flange", "tool0_site: palm", "'palm'"),
            ("max_width_m: 0.1", "max_width_m: [", "not readable YAML"),
        ],
    )
    def test_bad_files_are_named_with_their_fault(self, write_other_robot, old, new, words):
        with pytest.raises(InputError, match=words):
            load_robot(write_other_robot(old, new))

    def test_fingers_that_no_object_can_touch_are_refused(self, write_other_robot):
        pad = '<geom name="right_pad" type="box" size="0.005 0.01 0.02" pos="0.005 0 0.02"'
        path = write_other_robot(pad, f'{pad} contype="2" conaffinity="4"', mjcf=True)
        with pytest.raises(InputError, match=r"'right_pad'.*contype"):
            load_robot(path)

    def test_a_joint_that_nobody_moves_is_an_error(self, write_other_robot):
        stand = '<body name="stand"'
        lid = '<body name="lid"><joint/><geom size="1"/></body>' + stand
        with pytest.raises(InputError, match="lid"):
            load_robot(write_other_robot(stand, lid, mjcf=True))

    def test_mjcf_that_mujoco_refuses(self, write_other_robot):
        with pytest.raises(InputError, match="MuJoCo cannot compile"):
            load_robot(write_other_robot("</mujoco>", "<nonsense/></mujoco>", mjcf=True))

    def test_unknown_name(self):
        with pytest.raises(UnknownNameError, match="sda10f_2f85"):
            load_robot("sda10f_2f58")


class TestRest:
    def test_parts_that_are_in_each_other_where_it_waits_are_named_with_the_remedy(self, write_other_robot):
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


ASSETS = """
  <asset>
    <mesh name="cover" file="cover.obj"/>
    <texture name="paint" type="2d" file="paint.png"/><material name="paint" texture="paint"/>
  </asset>
  <worldbody><body name="cover"><geom type="mesh" mesh="cover" material="paint" contype="0" conaffinity="0"/></body>
  <include file="more.xml"/>
"""
COVER = "v 0 0 1\nv .1 0 1\nv 0 .1 1\nv 0 0 {}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
INCLUDED = (
    '<mujoco><body name="more" pos="0 0 {}"><geom size=".01" contype="0" conaffinity="0"/></body></mujoco>'
)


@pytest.fixture
def directory(write_other_robot, tmp_path):
    """A robot with a mesh, a texture and an included file."""
    path = write_other_robot("<worldbody>", ASSETS, mjcf=True)
    path.rename(tmp_path / "robot.yaml")
    _paint(tmp_path, 100)
    (tmp_path / "cover.obj").write_text(COVER.format(1.1))
    (tmp_path / "more.xml").write_text(INCLUDED.format(0.1))
    return tmp_path


def _paint(directory, shade):
    Image.fromarray(np.full((4, 4, 3), shade, np.uint8)).save(directory / "paint.png")


def _source(directory):
    return own_source(str(directory / "robot.yaml"))


def test_where_the_files_lie_does_not_count(directory, tmp_path_factory, monkeypatch):
    there = tmp_path_factory.mktemp("some other place") / "of_another_length"
    shutil.copytree(directory, there)
    assert _source(there) == _source(directory)
    monkeypatch.chdir(there)
    assert own_source("robot.yaml") == _source(directory)


@pytest.mark.parametrize("changed", ["robot.yaml", "other.xml", "more.xml", "cover.obj", "paint.png"])
def test_what_is_in_each_of_them_counts(directory, changed):
    before = _source(directory)
    assert len(before) == 64
    path = directory / changed
    match path.suffix:
        case ".yaml":
            path.write_text(path.read_text().replace("speed_deg_s: 90", "speed_deg_s: 80", 1))
        case ".obj":
            path.write_text(COVER.format(1.2))
        case ".png":
            _paint(directory, 101)
        case _:
            path.write_text(path.read_text().replace("0.1", "0.11", 1))
    os.utime(
        path, (0, path.stat().st_mtime + 5)
    )  # by whole seconds MuJoCo tells whether a mesh or picture is another
    assert _source(directory) != before


def test_shipped_robots_are_known_by_name_alone():
    assert own_source(DEFAULT_ROBOT) == ""
    assert len(load_robot().source) == 64
