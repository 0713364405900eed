"""What differs from gripper to gripper, and what its silence means."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

from lab_helpers.behind_twins import TimedFingers
from torc_lab.protocols import LabError
from torc_lab.robotiq.gripper import RobotiqConfig, RobotiqGripper, WidthScale, over_urcap
from torc_lab.robotiq.registers import READY, status_of
from torc_lab.robotiq.wires import ModbusWire
from torc_lab.twin.robotiq import ModbusTwin, RobotiqTwin, UrcapTwin


def test_a_silence_is_no_fault_and_the_gripper_is_asked_all_the_time():
    """A real one carries fault 9 in its first answer after a second of silence. 5 and 7 come before activation."""
    pytest.importorskip("pymodbus")
    twin, asked_s = RobotiqTwin(TimedFingers()), []
    read = twin.read
    twin.read = lambda: asked_s.append(time.monotonic()) or read()
    with ModbusTwin(twin) as there:
        twin._heard_s -= 2.0
        assert twin.read()[1] >> 8 == 0x09
        assert twin.read()[1] >> 8 == 0
        twin._heard_s -= 2.0
        gripper = RobotiqGripper(ModbusWire(there.address))
        assert not gripper.ready
        gripper.activate()
        twin._heard_s -= 2.0
        assert gripper.state.width_m == pytest.approx(0.085)
        began = time.monotonic()
        time.sleep(1.5)  # an arm moves
        gripper.disconnect()
        asked = [t for t in asked_s if t > began]
    assert len(asked) >= 4
    assert np.diff(asked).max() < 0.9
    ready, early = 0x0B00 | READY << 12, 0x0900
    for flags, fault, bad in (
        (ready, 0x09, False), (early, 0x07, False), (early, 0x05, False), (early, 0x09, False),
        (ready, 0x07, True), (ready, 0x0E, True), (early, 0x0A, True),
    ):  # fmt: skip
        status = status_of([flags, fault << 8, 0])
        if bad:
            with pytest.raises(LabError, match="reports fault"):
                status.check("it")
        else:
            status.check("it")


def test_a_gateway_that_knows_holding_registers_alone():
    asked = []

    class Client:
        def __getattr__(self, function):
            def exchange(address, **options):
                asked.append((function, address, options["count"]))
                if function == "read_input_registers":
                    return SimpleNamespace(isError=lambda: True, exception_code=1)
                return SimpleNamespace(isError=lambda: False, registers=[0xB900, 0x00FF, 0xBD00])

            return exchange

    pytest.importorskip("pymodbus")
    with ModbusTwin(RobotiqTwin(TimedFingers())) as there:
        wire = ModbusWire(there.address)
        wire.status()  # the twin has taken the connection in, and can end it
        real, wire._client = wire._client, Client()
        for _ in range(2):
            assert wire.status().position == 0xBD
        real.close()
    assert [a[0] for a in asked] == [
        "read_input_registers",
        "read_holding_registers",
        "read_holding_registers",
    ]


def test_the_wide_gripper_has_a_force_range_of_its_own():
    assert WidthScale().force_n == (20.0, 235.0)
    assert WidthScale(max_width_m=0.14).force_n == (10.0, 125.0)
    twin = RobotiqTwin(TimedFingers())
    with UrcapTwin(twin) as there:
        gripper = over_urcap(RobotiqConfig(address=there.address, max_width_m=0.14))
        gripper.activate()
        for force_n, count in ((10.0, 0), (67.5, 128), (125.0, 255), (300.0, 255)):
            gripper.close(force_n)
            assert twin.written[-1][2] & 0xFF == pytest.approx(count, abs=1)
        gripper.disconnect()
