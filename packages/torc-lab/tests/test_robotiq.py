"""A Robotiq gripper over its real wires: Modbus TCP, Modbus RTU byte for byte, and the socket of a UR."""

import os
import socket
import threading
import time
import tty
from contextlib import suppress

import pytest

from lab_helpers.behind_twins import TimedFingers
from torc.errors import InputError
from torc.robots.protocols import Gripper
from torc_lab.protocols import LabError
from torc_lab.robotiq.gripper import RobotiqGripper, WidthScale
from torc_lab.robotiq.registers import ACTIVATE, FAULTS, RESET, GripperCommand, Object, status_of
from torc_lab.robotiq.wires import ModbusWire, UrcapWire
from torc_lab.twin.robotiq import ModbusTwin, RobotiqTwin, UrcapTwin

pytest.importorskip("pymodbus")

# Of the manual (2F-85 & 2F-140 instruction manual, "Modbus RTU example"), and of a gripper that was listened to.
WRITE = bytes.fromhex("09 10 03 E8 00 03 06 09 00 00 00 FF FF 72 19")
WRITTEN = bytes.fromhex("09 10 03 E8 00 03 01 30")
READ = bytes.fromhex("09 04 07 D0 00 03 B1 CE")
GRASPED = bytes.fromhex("09 04 06 B9 00 00 FF BD 00 5C 9A")
OPENED = bytes.fromhex("09 04 06 F9 00 00 00 0D 00 17 AA")


class Line:
    """The other end of a serial line: answers what it knows, and keeps what it heard."""

    def __init__(self, answers):
        self.answers, self.heard = answers, []
        ours, theirs = os.openpty()
        tty.setraw(ours)
        tty.setraw(theirs)
        self.port, self._fd, self._open = os.ttyname(theirs), ours, True
        self._ends = ours, theirs
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        frame = b""
        while True:
            try:
                frame += os.read(self._fd, 256)
            except OSError:
                return
            if frame in self.answers:
                self.heard.append(frame)
                os.write(self._fd, self.answers[frame])
                frame = b""

    def close(self):
        for end in self._ends:
            os.close(end)


def test_golden_frames_on_a_serial_line():
    pytest.importorskip("serial")
    line = Line({WRITE: WRITTEN, READ: GRASPED})
    wire = ModbusWire(line.port)
    try:
        wire.send(GripperCommand(position=0, speed=255, force=255))
        status = wire.status()
        assert line.heard == [WRITE, READ]
        assert (status.object, status.position, status.requested) == (Object.STOPPED_CLOSING, 189, 255)
        assert status.ready
        line.answers[READ] = OPENED
        assert (wire.status().object, wire.status().position) == (Object.AT_POSITION, 13)
        line.answers[READ] = OPENED[:-1] + b"\x00"  # a wrong checksum
        with pytest.raises(LabError, match="does not answer"):
            wire.status()
    finally:
        wire.close()
        line.close()


def test_the_registers_of_the_manual():
    assert ACTIVATE.registers == (0x0100, 0, 0)
    assert RESET.registers == (0, 0, 0)
    assert GripperCommand(position=0x80, speed=0x10, force=0x20).registers == (0x0900, 0x80, 0x1020)
    with pytest.raises(ValueError, match="force"):
        GripperCommand(force=256)
    with pytest.raises(LabError, match="3 registers"):
        status_of([1, 2])


@pytest.fixture(params=["modbus", "urcap"])
def rig(request):
    fingers = TimedFingers()
    twin = RobotiqTwin(fingers)
    server, wire = {"modbus": (ModbusTwin, ModbusWire), "urcap": (UrcapTwin, UrcapWire)}[request.param]
    with server(twin) as there:
        connection = wire(there.address)
        gripper = RobotiqGripper(connection)
        gripper.activate()
        yield gripper, fingers, twin
        gripper.disconnect()


def test_it_opens_closes_and_feels(rig):
    gripper, fingers, _ = rig
    assert isinstance(gripper, Gripper)
    assert gripper.open(gripper.max_width_m).width_m == pytest.approx(0.085)
    half = gripper.open(0.04)
    assert half.width_m == pytest.approx(0.04, abs=0.0005)
    assert not half.holding
    fingers.object_at = 100
    held = gripper.close(50.0)
    assert held.holding
    assert held.width_m == pytest.approx(WidthScale().width_m(100))
    assert gripper.state == held
    fingers.object_at = None  # it slips out
    fingers.go(255, 255, 0)
    deadline = time.monotonic() + 5
    while gripper.state.holding and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not gripper.state.holding
    assert gripper.state.width_m == 0
    assert not gripper.close(50.0).holding
    with pytest.raises(InputError, match="opens 0 to"):
        gripper.open(0.2)
    with pytest.raises(InputError, match="positive"):
        gripper.close(0.0)


def test_fingers_that_follow_what_they_hold_hold_it(rig):
    gripper, fingers, _ = rig
    fingers.object_at = 100
    assert gripper.close(50.0).holding
    fingers.object_at = 150  # it turned between the pads as the arm set off
    fingers.go(255, 0, 0)
    seen = []
    while (state := gripper.state).width_m > WidthScale().width_m(150) + 1e-6:
        seen.append(state.holding)
    assert seen
    assert all(seen)
    assert gripper.state.holding
    assert not gripper.open(gripper.max_width_m).holding
    fingers.go(255, 0, 0)  # not told by this gripper
    assert not gripper.state.holding


def test_widths_are_right_once_it_is_calibrated(rig):
    gripper, fingers, _ = rig
    fingers.ends = (13, 221)
    assert gripper.calibrate() == WidthScale(13, 221)
    fingers.object_at = 117
    assert gripper.close(20.0).width_m == pytest.approx(0.0425)
    fingers.object_at = 30
    with pytest.raises(LabError, match="between its fingers"):
        gripper.calibrate()


def test_faults_and_a_gripper_that_was_never_activated_are_told(rig):
    gripper, _, twin = rig
    twin.fault = 0x0E
    with pytest.raises(LabError, match=FAULTS[0x0E][:20]):
        gripper.close(50.0)
    twin.fault = 0
    gripper.wire.send(RESET)
    assert not gripper.ready
    with pytest.raises(LabError, match="not activated"):
        gripper.open(0.05)


def test_a_gripper_that_is_not_there_is_told_at_once():
    for wire in (ModbusWire, UrcapWire):
        with pytest.raises(LabError, match="cannot be reached"):
            wire("127.0.0.1:9")
        with pytest.raises(LabError, match="no address"):
            wire("127.0.0.1:grip")


def test_a_connection_that_ends_is_told():
    with ModbusTwin(RobotiqTwin(TimedFingers())) as there:
        wire = ModbusWire(there.address, timeout_s=0.2)
        wire.status()
    with pytest.raises(LabError, match="does not answer"):
        wire.status()


def test_widths_and_positions_go_round():
    scale = WidthScale(3, 230, 0.085)
    for count in range(3, 231):
        assert scale.count(scale.width_m(count)) == count
    assert scale.width_m(255) == 0
    with pytest.raises(InputError, match="No widths"):
        WidthScale(200, 100)


class Liar:
    """A Modbus TCP server that answers each request with rubbish of about the right form."""

    def __init__(self, rng):
        self.rng, self.asked = rng, 0
        self.server = socket.create_server(("127.0.0.1", 0))
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()

    @property
    def address(self):
        return f"127.0.0.1:{self.server.getsockname()[1]}"

    def _serve(self):
        while True:
            try:
                connection, _ = self.server.accept()
            except OSError:
                return
            with suppress(OSError), connection:
                while request := connection.recv(300):
                    self.asked += 1
                    connection.sendall(self._answer(request))

    def _answer(self, request):
        good = request[:4] + bytes([0, 9]) + request[6:8] + bytes([6]) + self.rng.bytes(6)
        data = bytearray(good)
        if self.rng.random() < 0.7:
            data[self.rng.integers(len(data))] = self.rng.integers(256)
        return bytes(data[: int(self.rng.integers(1, len(data) + 1))] if self.rng.random() < 0.1 else data)


def test_rubbish_on_the_wire_is_an_error_in_words_and_never_a_grip(rng):
    liar, refused = Liar(rng), 0
    while liar.asked < 300:
        try:
            wire = ModbusWire(liar.address, timeout_s=0.02)
        except LabError:
            continue
        try:
            for _ in range(20):
                status = wire.status()
                assert 0 <= status.position <= 255
        except LabError:
            refused += 1
        finally:
            wire.close()
    liar.server.close()
    assert refused > 5


def test_ten_thousand_statuses_are_read_or_refused(rng):
    for _ in range(10_000):
        registers = rng.integers(-5, 70_000, int(rng.integers(0, 6))).tolist()
        with suppress(LabError):
            status = status_of(registers)
            assert len(registers) == 3
            with suppress(LabError):
                status.check("it")
