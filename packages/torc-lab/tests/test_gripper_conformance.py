"""The conformance suite of gripper drivers: torc's own pass it on their twins, and broken ones are found out."""

from contextlib import contextmanager

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm, TimedFingers
from torc.robots.protocols import GripperState
from torc.testing.conformance import NonConformanceError
from torc_lab.protocols import LabError
from torc_lab.robotiq.gripper import RobotiqGripper
from torc_lab.robotiq.wires import ModbusWire
from torc_lab.ros.franka_hand import FrankaHand, FrankaHandConfig
from torc_lab.testing.gripper_conformance import check_gripper_driver
from torc_lab.twin.franka import FrankaHandTwin
from torc_lab.twin.robotiq import ModbusTwin, RobotiqTwin
from torc_lab.twin.ros import RosTwin


@contextmanager
def robotiq():
    with ModbusTwin(RobotiqTwin(TimedFingers())) as there:
        yield lambda: RobotiqGripper(ModbusWire(there.address))


@contextmanager
def franka():
    pytest.importorskip("websockets")
    hand, joints = FrankaHandTwin(TimedFingers(), 0.08), [f"j{i}" for i in range(7)]
    with RosTwin(ObedientArm(np.zeros(7)), joints, hand=hand) as bridge:
        yield lambda: FrankaHand(FrankaHandConfig(bridge.url, timeout_s=2.0))


@pytest.mark.parametrize("rig", [robotiq, franka])
def test_shipped_drivers_keep_the_rules(rig):
    with rig() as connect:
        check_gripper_driver(connect)


class Gripper:
    max_width_m = 0.085

    def __init__(self):
        self.width_m, self.connected = self.max_width_m, True

    @property
    def state(self):
        return GripperState(self.width_m, holding=False)

    def open(self, width_m):
        if not self.connected:
            raise LabError("disconnected")
        self.width_m = width_m
        return self.state

    def close(self, force_n):
        self.width_m = 0.0
        return self.state

    def disconnect(self):
        self.connected = False


class InMillimetres(Gripper):
    max_width_m = 85.0


class Lazy(Gripper):
    def open(self, width_m):
        return super().open(self.max_width_m)


class Grips(Gripper):
    def close(self, force_n):
        return GripperState(0.0, holding=True)


class Stays(Gripper):
    def disconnect(self):
        pass


def test_a_good_one_passes():
    check_gripper_driver(Gripper)


@pytest.mark.parametrize(
    ("driver", "fault"),
    [
        (InMillimetres, "in metres"),
        (Lazy, "pads 0.085 m apart"),
        (Grips, "holding=True"),
        (Stays, "connection has ended"),
        (object, "lacks"),
    ],
)
def test_broken_ones_are_named(driver, fault):
    with pytest.raises(NonConformanceError, match=fault):
        check_gripper_driver(driver)
