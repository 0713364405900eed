"""Both sides of the gripper's serial line against somebody else's: pymodbus's server, and the driver robotiq2f."""

import os
import select
import threading
import time
import tty

import pytest

from lab_helpers.behind_twins import TimedFingers
from torc_lab.robotiq.gripper import RobotiqConfig, over_modbus
from torc_lab.twin.robotiq import ModbusTwin, RobotiqTwin

pytest.importorskip("pymodbus")
pytest.importorskip("serial")


@pytest.fixture
def cable():
    """Two serial ports that are connected."""
    ends = [os.openpty() for _ in range(2)]
    for pair in ends:
        for fd in pair:
            tty.setraw(fd)
    masters, ended = [m for m, _ in ends], threading.Event()

    def carry():
        while not ended.is_set():
            for fd in select.select(masters, [], [], 0.05)[0]:
                os.write(masters[1 - masters.index(fd)], os.read(fd, 256))

    thread = threading.Thread(target=carry)
    thread.start()
    yield [os.ttyname(slave) for _, slave in ends]
    ended.set()
    thread.join()
    for pair in ends:
        for fd in pair:
            os.close(fd)


@pytest.fixture
def fingers():
    return TimedFingers()


@pytest.fixture
def port(cable, fingers):
    """The port at which a gripper hangs."""
    with ModbusTwin(RobotiqTwin(fingers), line=cable[0]):
        yield cable[1]


def test_our_driver_on_a_serial_line(port, fingers):
    gripper = over_modbus(RobotiqConfig(address=port))
    try:
        assert not gripper.ready
        gripper.activate()
        assert gripper.open(0.04).width_m == pytest.approx(0.04, abs=5e-4)
        fingers.object_at = 120
        assert gripper.close(50).holding
    finally:
        gripper.disconnect()


def rests(gripper, opening):
    """Goes there; robotiq2f keeps a status for 5 ms, and may take the one from before for the end of the motion."""
    gripper.go_to(opening=opening, speed=150, force=50)
    time.sleep(0.02)
    while gripper.is_moving:
        time.sleep(0.02)


def test_the_driver_robotiq2f_finds_a_gripper_in_our_twin(port, fingers, monkeypatch):
    robotiq2f = pytest.importorskip("robotiq2f")
    monkeypatch.setattr(robotiq2f.LinuxFindTTYWithSerialNumber, "find", lambda self, number: port)
    gripper = robotiq2f.Robotiq2F85("any", async_control=False)
    with gripper:
        gripper.client.serial.timeout = 1.0
        assert gripper.is_reset
        gripper.activate()
        assert gripper.is_activated
        rests(gripper, 40)
        assert gripper.opening == pytest.approx(40, abs=1)
        assert not gripper.object_detected
        fingers.object_at = 180
        rests(gripper, 0)
        assert gripper.object_detected
        assert gripper.opening == pytest.approx(gripper.count_to_opening(180))
        assert not gripper.in_fault
        gripper.deactivate(blocking_call=False)
