"""A gripper's statuses that come late, twice, or out of order: never taken for another command."""

import socket
import threading
from contextlib import suppress

import pytest

from lab_helpers.behind_twins import TimedFingers
from torc_lab.protocols import LabError
from torc_lab.robotiq import gripper as gripper_module
from torc_lab.robotiq.gripper import RobotiqGripper
from torc_lab.robotiq.registers import ACTIVATE, Object, status_of
from torc_lab.robotiq.wires import ModbusWire
from torc_lab.twin.robotiq import RobotiqTwin

MANY = 10_000


def test_ten_thousand_statuses_of_a_gripper_are_never_taken_for_another_command(rng, monkeypatch):
    """What it tells of itself comes late, twice and out of order. A grip is claimed only for this closing."""
    clock = [0.0]

    class Clock:
        monotonic = staticmethod(lambda: clock[0])

        @staticmethod
        def sleep(seconds):
            clock[0] += seconds

    monkeypatch.setattr(gripper_module, "time", Clock)
    monkeypatch.setattr(RobotiqGripper, "_keep_awake", lambda gripper: None)  # it lives in real time
    monkeypatch.setattr("lab_helpers.behind_twins.time", Clock)
    monkeypatch.setattr("torc_lab.twin.robotiq.time", Clock)
    fingers = TimedFingers()
    twin = RobotiqTwin(fingers)

    class Wire:
        name, read, past, since = "the wire", 0, [], 0

        def send(self, command):
            twin.write(0, list(command.registers))
            self.since, self.command = len(self.past), command

        def status(self):
            self.read += 1
            clock[0] += 0.004
            self.past.append(status_of(twin.read()))
            late = rng.random() < 0.4
            at = max(0, len(self.past) - 1 - int(rng.integers(0, 40)) * late)
            self.told = at
            return self.past[at]

        def close(self):
            return None

    wire = Wire()
    twin.write(0, list(ACTIVATE.registers))
    clock[0] += 1
    gripper, moves, refused = RobotiqGripper(wire), 0, 0
    while wire.read < MANY:
        fingers.object_at = None if rng.random() < 0.5 else int(rng.integers(60, 200))
        began, moves = clock[0], moves + 1
        try:
            closing = rng.random() < 0.5
            state = gripper.close(50.0) if closing else gripper.open(float(rng.uniform(0, 0.085)))
            told = wire.past[wire.told]
            assert told.requested == wire.command.position
            assert told.object is not Object.MOVING
            assert state.holding <= (closing and told.object is Object.STOPPED_CLOSING)
        except LabError:
            refused += 1
        assert clock[0] - began < 12
    assert moves > 100
    assert refused < moves


def test_modbus_answers_that_come_late_or_twice_are_not_taken_for_the_next(rng):
    """By their transaction: a status is that of its own question, or there is none."""
    pytest.importorskip("pymodbus")
    server, asked = socket.create_server(("127.0.0.1", 0)), []

    def serve():
        with suppress(OSError):
            while True:
                connection, _ = server.accept()
                past = []
                with connection, suppress(OSError):
                    while request := connection.recv(300):
                        asked.append(request)
                        position = len(asked) % 200
                        flags = bytes([0xF9, 0, 0, position, position, 0])
                        past.append(request[:4] + bytes([0, 9]) + request[6:8] + bytes([6]) + flags)
                        kind = rng.random()
                        if kind < 0.1:
                            past and connection.sendall(past[int(rng.integers(len(past)))])
                        elif kind < 0.2:
                            connection.sendall(past[-1] + past[-1])
                        else:
                            connection.sendall(past[-1])

    threading.Thread(target=serve, daemon=True).start()
    address, good, lost = f"127.0.0.1:{server.getsockname()[1]}", 0, 0
    while good < 200 and lost < 300:
        wire = ModbusWire(address, timeout_s=0.05)
        with suppress(LabError):
            for _ in range(30):
                status = wire.status()
                assert status.position == len(asked) % 200
                good += 1
        lost += 1
        wire.close()
        with pytest.raises(LabError, match="lost"):
            wire.status()
    server.close()
    assert good >= 200
