"""The conformance suite of arm drivers: torc's own pass it on their twins, and broken ones are found out."""

from contextlib import contextmanager

import numpy as np
import pytest

from fake_arm import FakeArmDriver
from lab_helpers.behind_twins import ObedientArm
from torc.testing.conformance import NonConformanceError
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.simple_message.arm import MotomanArm, MotomanConfig
from torc_lab.testing.arm_conformance import check_arm_driver
from torc_lab.twin.motoman import MotomanTwin
from torc_lab.twin.ros import RosTwin
from torc_lab.twin.ur import UrTwin
from torc_lab.ur.arm import UrArm, UrConfig


@contextmanager
def ros(robot, version):
    pytest.importorskip("websockets")
    with RosTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.joint_names, version) as twin:
        names = tuple(twin.joint_names)
        topics = {"status_topic": "/robot_status", "status": "industrial"}
        yield lambda: RosArm(RosArmConfig(twin.url, version, twin.action, names, **topics))


@contextmanager
def motoman(robot):
    with MotomanTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.max_speed) as twin:
        motion_port, state_port = twin.ports

        def connect():
            driver = MotomanArm(MotomanConfig("127.0.0.1", 1, motion_port, state_port), 7)
            driver.enable()
            return driver

        yield connect


@contextmanager
def ur(robot):
    pytest.importorskip("rtde_control", reason="ur_rtde is not installed")
    with UrTwin(ObedientArm(np.zeros(6))) as twin:
        yield lambda: UrArm(UrConfig(twin.host))


@contextmanager
def fake(robot):
    yield lambda: FakeArmDriver(robot.arm.rest_qpos.copy())


RIGS = {"ros1": lambda r: ros(r, 1), "ros2": lambda r: ros(r, 2), "motoman": motoman, "ur": ur, "fake": fake}


@pytest.mark.long
@pytest.mark.parametrize("name", RIGS)
def test_every_driver_conforms(name, robot):
    with RIGS[name](robot) as connect:
        check_arm_driver(connect)


class Deaf(FakeArmDriver):
    def stop(self):
        self.stops += 1


class Boaster(FakeArmDriver):
    def ended(self):
        self._check()
        return ""


class Undead(FakeArmDriver):
    def close(self):
        return None


@pytest.mark.long
@pytest.mark.parametrize(
    ("broken", "words"), [(Deaf, "did not stop it"), (Boaster, "be None"), (Undead, "must raise LabError")]
)
def test_broken_drivers_are_found_out(broken, words, robot):
    with pytest.raises(NonConformanceError, match=words):
        check_arm_driver(lambda: broken(robot.arm.rest_qpos.copy()))
