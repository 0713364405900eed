"""The arm behind a driver is the modelled one, and its torso is where the model has it; own drivers are whole."""

import re
import textwrap
import time
from dataclasses import dataclass, replace

import pytest

from lab_helpers.behind_twins import ObedientArm
from torc.errors import InputError
from torc_lab.checking import check_lab
from torc_lab.devices import connect_arm, connect_gripper
from torc_lab.identity import check_names, check_standing
from torc_lab.lab_file import Device, example_labs, load_lab
from torc_lab.protocols import LabError
from torc_lab.twin.motoman import READY, MotomanTwin
from torc_lab.twin.ros import RosTwin


def lab_of(tmp_path, text):
    path = tmp_path / "lab.yaml"
    path.write_text(text, encoding="utf-8")
    return load_lab(path)


@pytest.mark.parametrize(
    ("name", "good", "bad", "words"),
    [
        ("sda10f-ros1", "sda10f_r2_controller", "sda10f_r1_controller", "that of the left arm"),
        (
            "sda10f-simple-message",
            "group: 1",
            "group: 0",
            "group 0 is another arm; the modelled one is group 1",
        ),
        ("sda10f-simple-message", "group: 1", "group: 2", "group 2 is another arm"),
    ],
)
def test_a_lab_file_that_names_the_other_arm_is_refused(tmp_path, name, good, bad, words):
    text = example_labs()[name]
    assert good in text
    lab_of(tmp_path, text)
    with pytest.raises(InputError, match=words):
        lab_of(tmp_path, text.replace(good, bad))


def test_names_of_joints_fit_one_by_one(robot):
    own = robot.arm.joint_names
    check_names(own, own, "here")
    check_names(own, [f"robot1/{name}" for name in own], "here")
    panda = [f"panda_joint{k}" for k in range(1, 8)]
    check_names(panda, [f"fr3_joint{k}" for k in range(1, 8)], "here")
    ur = (
        "shoulder_pan_joint",
        "shoulder_lift_joint",
        "elbow_joint",
        "wrist_1_joint",
        "wrist_2_joint",
        "wrist_3_joint",
    )
    check_names(ur, [f"left_{name}" for name in ur], "here")
    for wrong in (
        [name.replace("right", "left") for name in own],
        own[::-1],
        (own[1], own[0], *own[2:]),
        own[:6],
        [f"joint_{k}" for k in range(7)],
    ):
        with pytest.raises(InputError, match="joint"):
            check_names(own, wrong, "here")
    with pytest.raises(InputError, match="another arm"):
        check_names(ur, [ur[1], ur[0], *ur[2:]], "here")


def test_a_turned_torso_is_noticed_at_the_connection(tmp_path, robot):
    text = example_labs()["sda10f-simple-message"]
    with MotomanTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.max_speed) as twin:
        twin.state = READY
        motion, state = twin.ports
        lab = lab_of(
            tmp_path,
            text.replace("192.168.255.1", f"127.0.0.1\n  motion_port: {motion}\n  state_port: {state}"),
        )
        connect_arm(lab).close()
        twin.torso = 0.2
        with pytest.raises(
            LabError, match=r"group 2 is at 0\.200 rad; the robot description has it at 0\.000"
        ):
            connect_arm(lab)
    pytest.importorskip("websockets")
    with RosTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.joint_names, 1) as twin:
        text = example_labs()["sda10f-ros1"].replace("ws://192.168.1.10:9090", twin.url)
        lab = lab_of(tmp_path, text)
        connect_arm(lab).close()
        twin.others["torso_joint_b1"] = -0.1
        with pytest.raises(LabError, match=r"torso_joint_b1 is at -0\.100 rad"):
            connect_arm(lab)


@dataclass
class Seeing:
    others: dict

    def other_joints(self):
        return self.others


def test_held_joints_of_a_lab_file(robot):
    arm = replace(robot.arm, joint_names=tuple("abcdefg"))
    assert check_standing(arm, Seeing({"lift": 0.301}), {"lift": 0.3}) == []
    assert check_standing(arm, Seeing({}), {"lift": 0.3}) == ["lift"]
    with pytest.raises(LabError, match=r"lift is at 0\.350"):
        check_standing(arm, Seeing({"lift": 0.35}), {"lift": 0.3})


OWN = """
import time
import numpy as np
from torc_lab.protocols import ArmStatus
from torc.robots.protocols import GripperState

CLOSED = []

class Hand:
    max_width_m = 0.085
    @property
    def state(self): return GripperState(0.085, False)
    def open(self, width_m): return self.state
    def close(self, force_n=50.0):
        CLOSED.append(force_n)
        return self.state

class Whole(Hand):
    def disconnect(self): pass

class Arm:
    name, feels_contact, start_tolerance_rad = "mine", False, 0.001
    def status(self): return ArmStatus(time.time(), np.zeros(7), False)
    def start(self, trajectory): raise AssertionError("it must not move")
    def ended(self): return ""
    def stop(self): pass
    def close(self): pass

class Half:
    name = "half"
    def start(self, trajectory): pass
    def status(self): return ArmStatus(time.monotonic(), np.zeros(7), False)

class Broken(Arm):
    def status(self): return {}["nothing"]
"""


@pytest.fixture
def own(tmp_path):
    """A lab of user-defined drivers."""
    path = tmp_path / f"own_{time.monotonic_ns()}.py"
    path.write_text(textwrap.dedent(OWN), encoding="utf-8")
    lab = lab_of(tmp_path, example_labs()["sda10f-ros1"])

    def made(arm="Arm", gripper="Whole"):
        return replace(lab, arm=Device(f"{path}:{arm}", {}), gripper=Device(f"{path}:{gripper}", {}))

    return made


def closed(gripper):
    return type(gripper).close.__globals__["CLOSED"]


def test_a_gripper_is_never_closed_to_end_its_connection(own):
    whole = connect_gripper(own(gripper="Whole"))
    findings = [f for f in check_lab(own(gripper="Whole")) if f.device == "gripper"]
    assert all(f.good for f in findings)
    assert closed(whole) == []
    findings = [f for f in check_lab(own(gripper="Hand")) if f.device == "gripper"]
    assert [f.good for f in findings] == [False]
    assert "lacks disconnect: see torc_lab.protocols.GripperDriver" in findings[0].text
    assert closed(whole) == []


@pytest.mark.parametrize(
    ("arm", "words"),
    [
        ("Arm", r"seconds? in the future|s in the future: stamp_s is by time\.monotonic"),
        ("Half", r"lacks name|lacks .*feels_contact.*start_tolerance_rad.*ended.*stop.*close"),
        ("Broken", r"Arm driver .* failed with KeyError: 'nothing'"),
    ],
)
def test_what_an_own_driver_lacks_is_named_and_is_no_traceback(own, arm, words):
    findings = [f for f in check_lab(own(arm=arm), lambda question: True) if f.device == "arm"]
    assert not any(f.good for f in findings)
    assert any(re.search(words, f.text) for f in findings), findings
