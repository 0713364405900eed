"""A robot that would miss every pick is refused when it is loaded, by the name of what is wrong."""

import pytest

from torc.errors import InputError
from torc.robots.loading import load_robot
from torc.robots.parsing import compile_mjcf, try_robot
from torc.robots.proving import sags_rad

M2 = '<position name="m2" joint="a2" kp="3000" dampratio="1"/>'
GRIP = (
    '<general name="grip" joint="slide_right" ctrlrange="0 255" gainprm="0.2" biastype="affine" '
    'biasprm="0 -1000 -60"/>'
)
TIP = '<site name="right_tip" pos="0 0 0.04"/>'
STAND = '<body name="stand" pos="0.1 0.2 0.3">'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (M2, '<motor name="m2" joint="a2"/>', "'m2' does not bring the joint 'a2' .*: it is a motor"),
        (M2, '<velocity name="m2" joint="a2" kv="50"/>', "velocity servo; a position servo"),
        (M2, '<position name="m2" joint="a3" kp="3000" dampratio="1"/>', "it drives the joint 'a3'"),
        (M2, '<position name="m2" joint="a2" kp="3000" dampratio="1" gear="-1"/>', "gear is -1"),
        (M2, '<position name="m2" joint="a2" kp="3000" dampratio="1" gear="50"/>', "gear is 50"),
        (M2, '<position name="m2" joint="a2" kp="3000" dampratio="1" ctrlrange="0 0.1"/>', "ctrlrange is 0 to 0.1"),
        (
            M2,
            '<general name="m2" joint="a2" gainprm="100" biastype="affine" biasprm="0 -3000 -60"/>',
            "gain and bias differ",
        ),
        (
            GRIP,
            '<position name="grip" joint="slide_left" kp="2000" kv="60" ctrlrange="0 0.05"/>',
            "",
        ),
        (
            GRIP,
            '<general name="grip" joint="slide_right" ctrlrange="0 255" gainprm="-0.2" biastype="affine" '
            'biasprm="50 -1000 -60"/>',
            r"opens at the upper end of the ctrlrange of 'grip' \(it opens 0 mm at the lower end and 10\d mm",
        ),
        (GRIP, GRIP.replace('ctrlrange="0 255"', 'ctrlrange="0 20"'), "does not close the gripper"),
        (GRIP, GRIP.replace(' ctrlrange="0 255"', ""), "needs a ctrlrange"),
        (TIP, TIP.replace("/>", ' euler="3.14159 0 0"/>'), "point outward"),
        (STAND, '<geom name="ground" type="plane" size="0 0 .1"/>' + STAND, r"holds a plane \(ground\)"),
        (STAND, '<geom type="plane" size="1 1 .1" pos="0 0 -1"/>' + STAND, "holds a plane"),
        (STAND, '<geom name="desk" type="box" size=".5 .5 .02"/>' + STAND, r"geom of the world \(desk\)"),
        (STAND, '<body><freejoint/><geom size=".02"/></body>' + STAND, "moves freely|belongs neither"),
    ],
)  # fmt: skip
def test_what_would_miss_every_pick_is_refused(write_other_robot, old, new, words):
    path = write_other_robot(old, new, mjcf=True)
    if not words:
        assert load_robot(path).arm.dof == 6
        return
    with pytest.raises(InputError, match=words):
        load_robot(path)


def test_all_faults_are_named_at_once(write_other_robot):
    path = write_other_robot()
    mjcf = path.with_name("other.xml")
    text = mjcf.read_text().replace("<position", "<motor").replace(' kp="3000" dampratio="1"', "")
    mjcf.write_text(text)
    with pytest.raises(InputError) as error:
        load_robot(path)
    assert str(error.value).count("it is a motor") == 6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '<?xml version="1.0"?>\n<!-- made by hand -->\n<robot name="r"><link name="a"/></robot>',
            "is a URDF",
        ),
        (
            '<robot xmlns:xacro="http://ros.org/wiki/xacro" name="r"><xacro:include filename="x"/></robot>',
            "a URDF or a xacro",
        ),
        ('<robot name="r"><xacro:include filename="x"/></robot>', "a URDF or a xacro"),
        ("<robot/>", "is a URDF"),
        ('<?xml version="1.0" encoding="nonsense"?><robot/>', "is a URDF"),
        ('<?xml version="1.0" encoding="nonsense"?><mujoco', "MuJoCo cannot compile"),
        ("<sdf version='1.9'><model/></sdf>", "MuJoCo cannot compile"),
        ("not xml at all", "MuJoCo cannot compile"),
    ],
)
def test_other_formats_are_told_apart(write_other_robot, text, words):
    path = write_other_robot()
    path.with_name("other.xml").write_text(text)
    with pytest.raises(InputError, match=words):
        load_robot(path)


def test_servos_that_are_too_weak_give_way(write_other_robot):
    path = write_other_robot(M2, M2.replace("3000", "30"), mjcf=True)
    robot, faults = try_robot(path)
    assert not any(faults.values())
    sags = sags_rad(robot, compile_mjcf(robot.mjcf_path))
    assert sags.shape == (6,)
    assert sags[1] > 0.05
