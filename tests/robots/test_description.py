"""Descriptions against MuJoCo's own view of the same file, and what happens to bad files."""

import numpy as np
import pytest

from torc.errors import InputError, UnknownNameError
from torc.robots.kinematics import sphere_centers
from torc.robots.loading import load_robot


def test_pairs_that_are_not_checked_cannot_touch(robot, rng):
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
            ("rest_qpos_rad: [0,", "rest_qpos_rad: [.nan,", "rest_qpos_rad.0: .*finite"),
            ("mjcf: other.xml", "mjcf: missing.xml", "missing.xml"),
            ("tool0_site: flange", "tool0_site: palm", "'palm'"),
            ("max_width_m: 0.1", "max_width_m: [", "Cannot read"),
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
