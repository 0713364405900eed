"""The text socket of Robotiq's program on a UR, string by string."""

import socket
import threading
import time
from contextlib import suppress

import pytest

from torc_lab.protocols import LabError
from torc_lab.robotiq.registers import ACTIVATE, RESET, GripperCommand, GripperStatus, Object
from torc_lab.robotiq.wires import UrcapWire
from torc_lab.twin.robotiq import UrcapTwin

# Of clients of the URCap that are in use (ur_rtde's robotiq_gripper): "SET NAME VALUE ..." is answered by "ack" without
# an end of line, "GET NAME" by "NAME VALUE" with one.
CLOSE = b"SET ACT 1 GTO 1 SPE 255 FOR 128 POS 230\n"
GRASPED = {"ACT": 1, "GTO": 1, "STA": 3, "OBJ": 2, "FLT": 0, "PRE": 230, "POS": 189}


class Program:
    """The other end: gives its answers piece by piece, and keeps what it heard."""

    def __init__(self, answer):
        self.answer, self.heard = answer, []
        self._server = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._server.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.close()

    def _serve(self):
        with suppress(OSError):
            connection, _ = self._server.accept()
            with connection, connection.makefile("rb") as lines:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                for line in lines:
                    self.heard.append(line)
                    for piece in self.answer(line):
                        connection.sendall(piece)
                        time.sleep(0.005)


def as_urcap(line):
    return [b"ack"] if line.startswith(b"SET") else [b"%s %d\n" % (line[4:-1], GRASPED[line[4:-1].decode()])]


@pytest.mark.parametrize(
    "cut",
    [
        lambda whole: [whole],
        lambda whole: [whole[k : k + 1] for k in range(len(whole))],  # a byte at a time
        lambda whole: [whole.rstrip(b"\n")],  # without an end of line
        lambda whole: [whole[:-2], whole[-2:].rstrip(b"\n")],  # and in two pieces
    ],
)
def test_golden_strings(cut):
    with Program(lambda line: cut(as_urcap(line)[0])) as program:
        wire = UrcapWire(program.address)
        wire.send(GripperCommand(position=230, speed=255, force=128))
        assert program.heard == [CLOSE]
        found = wire.status()
        assert program.heard[1:] == [f"GET {name}\n".encode() for name in GRASPED]
        assert found == GripperStatus(True, True, 3, Object.STOPPED_CLOSING, 0, 230, 189)
        for command, line in ((RESET, b"SET ACT 0 GTO 0"), (ACTIVATE, b"SET ACT 1 GTO 0")):
            wire.send(command)
            assert program.heard[-1].startswith(line)
        wire.close()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda line: [b"?\n"], "answered"),
        (lambda line: [b"POS 300\n"] if b"GET" in line else [b"ack"], "POS 300"),
        (lambda line: [line[4:-1] + "٣\n".encode()] if b"GET" in line else [b"ack"], "answered"),
        (lambda line: [line[4:-1] + b" -1\n"] if b"GET" in line else [b"ack"], "-1"),
        (lambda line: [line[4:-1] + b" 7\n"] if b"OBJ" in line else as_urcap(line), "object state 7"),
        (lambda line: [], "does not answer"),
        (lambda line: [b"x" * 300], "answered"),
    ],
)
def test_a_connection_is_lost_for_good_at_the_first_wrong_answer(answer, words):
    with Program(answer) as program:
        wire = UrcapWire(program.address, timeout_s=0.1)
        with pytest.raises(LabError, match=words):
            wire.status()
        heard = len(program.heard)
        for again in (wire.status, lambda: wire.send(RESET)):
            with pytest.raises(LabError, match="is lost"):
                again()
        assert len(program.heard) == heard


def test_a_late_answer_is_no_answer_to_another_question():
    """What comes after the time is up would be taken for the next number of the same name."""
    with Program(lambda line: time.sleep(0.2) or [b"ACT 1\n"]) as program:
        wire = UrcapWire(program.address, timeout_s=0.05)
        with pytest.raises(LabError, match="does not answer"):
            wire.status()
        time.sleep(0.3)
        with pytest.raises(LabError, match="is lost"):
            wire.status()


def test_the_twin_says_the_same_strings():
    class Registers:
        def __init__(self):
            self.written = []

        def write(self, offset, values):
            self.written.append((offset, values))

        def read(self):
            return [0xB900, 0x00E6, 0xBD00]  # activated, going, ready, stopped closing; asked for 230, at 189

    with UrcapTwin(Registers()) as twin:
        assert twin.answer(CLOSE.decode().split()) == "ack"
        assert twin.twin.written == [(0, [0x0900, 230, 255 << 8 | 128])]
        for name, value in GRASPED.items():
            assert twin.answer(["GET", name]) == f"{name} {value}\n"
