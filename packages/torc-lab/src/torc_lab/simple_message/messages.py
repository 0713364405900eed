"""The messages of MotoROS, byte for byte, in either byte order.

A frame is the length of the rest, then message type, communication type and reply type, then the body; all numbers have
four bytes. (Source: motoman_driver 1.9.12, MotoPlus/SimpleMessage.h; ROS-Industrial's simple_message.)
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, Self

import numpy as np
from jaxtyping import Float

from torc_lab.protocols import LabError

ByteOrder = Literal["big", "little"]
"""FS100: big. DX100, DX200, YRC1000: little."""
_SIGN: dict[ByteOrder, str] = {"big": ">", "little": "<"}
MOTION_PORT, STATE_PORT = 50240, 50241
JOINTS = 10
"""Numbers per joint quantity in a message, for every robot."""
_HEADER = 12
MAX_LENGTH = 4096
"""Largest length after the length field; the longest message has 544 bytes."""


class Kind(IntEnum):
    """Message types."""

    ROBOT_STATUS = 13
    JOINT_TRAJ_PT_FULL = 14
    JOINT_FEEDBACK = 15
    MOTION_CTRL = 2001
    MOTION_REPLY = 2002
    JOINT_FEEDBACK_EX = 2017


class Comm(IntEnum):
    """Communication types."""

    TOPIC = 1
    REQUEST = 2
    REPLY = 3


class Command(IntEnum):
    """Commands of a MOTION_CTRL message."""

    CHECK_MOTION_READY = 200101
    CHECK_QUEUE_COUNT = 200102
    STOP_MOTION = 200111
    START_TRAJ_MODE = 200121
    STOP_TRAJ_MODE = 200122


class Result(IntEnum):
    """Results in a MOTION_REPLY message. BUSY: send the point again."""

    SUCCESS = 0
    BUSY = 1
    FAILURE = 2
    INVALID = 3
    ALARM = 4
    NOT_READY = 5
    MP_FAILURE = 6


SUBCODES = {
    3001: "a message of wrong size",
    3002: "a wrong message header",
    3003: "a wrong message type",
    3004: "a group that it does not have",
    3005: "a wrong sequence number",
    3006: "an unknown command",
    3010: "wrong data",
    3011: "the trajectory does not start where the arm is",
    3012: "a position out of range",
    3013: "a joint would move too fast",
    3014: "a joint would be accelerated too much",
    3015: "a point without time, position or velocity",
    3016: "a time that is too long",
    3017: "a tool that it does not have",
    5001: "there is an alarm",
    5002: "there is an error",
    5003: "e-stop",
    5004: "it is not in play mode",
    5005: "it is not in remote mode",
    5006: "the servos are off",
    5007: "it is on hold",
    5008: "its job INIT_ROS is not started",
    5009: "its job waits for ROS",
    5010: "it waits at SKILLSEND",
    5011: "it was stopped by its power and force limit",
    5012: "an incremental move failed",
}
_ALL_FIELDS = 1 | 2 | 4
"""Time, position and velocity are present."""


@dataclass(frozen=True)
class Frame:
    """A message: its types, and its body as received."""

    kind: int
    comm: int
    body: bytes
    reply: int = 0

    def pack(self, order: ByteOrder) -> bytes:
        """Return the frame's bytes, with their length in front."""
        header = struct.pack(_SIGN[order] + "4i", _HEADER + len(self.body), self.kind, self.comm, self.reply)
        return header + self.body

    @classmethod
    def unpack(cls, data: bytes, order: ByteOrder) -> Self:
        """Read a frame from the bytes after the length. Raises LabError if they are too few."""
        kind, comm, reply = _numbers("3i", data[:_HEADER], order)
        return cls(kind, comm, data[_HEADER:], reply)


def byte_order(length: bytes) -> ByteOrder:
    """Return the byte order that makes this length of four bytes valid. Raises LabError if neither or both do."""
    found = [order for order in _SIGN if _HEADER <= int.from_bytes(length, order) <= MAX_LENGTH]
    if len(found) != 1:
        raise LabError(f"It sent {length.hex(' ')}, which is no length of a message of simple_message.")
    return found[0]


@dataclass(frozen=True)
class RobotStatus:
    """The controller's state: 1 yes, 0 no, -1 unknown; `mode` is 1 for teach and 2 for play."""

    drives_powered: int
    e_stopped: int
    error_code: int
    in_error: int
    in_motion: int
    mode: int
    motion_possible: int

    def pack(self, order: ByteOrder) -> bytes:
        return struct.pack(_SIGN[order] + "7i", *vars(self).values())

    @classmethod
    def unpack(cls, body: bytes, order: ByteOrder) -> Self:
        """Read a status. Raises LabError for another size."""
        return cls(*_numbers("7i", body, order))

    @property
    def stopped(self) -> str:
        """Why nothing moves, "" if it may move. Unknown values count as reasons."""
        reasons = {
            "e-stop": self.e_stopped != 0,
            f"alarm {self.error_code}": self.in_error != 0,
            "teach mode": self.mode != 2,
            "the servos are off": self.drives_powered != 1,
            "it is not ready for motion": self.motion_possible != 1,
        }
        return next((text for text, true in reasons.items() if true), "")


@dataclass(frozen=True)
class TrajectoryPoint:
    """One point of a group's trajectory; point 0 is the arm's position."""

    group: int
    sequence: int
    time_s: float
    qpos: Float[np.ndarray, "dof"]
    qvel: Float[np.ndarray, "dof"]

    def pack(self, order: ByteOrder) -> bytes:
        numbers = [self.time_s, *_padded(self.qpos), *_padded(self.qvel), *_padded([])]
        return struct.pack(_SIGN[order] + "3i31f", self.group, self.sequence, _ALL_FIELDS, *numbers)

    @classmethod
    def unpack(cls, body: bytes, order: ByteOrder) -> Self:
        """Read a point, with all JOINTS numbers. Raises LabError for another size, or if fields are left out."""
        group, sequence, valid, time_s, *rest = _numbers("3i31f", body, order)
        if valid & _ALL_FIELDS != _ALL_FIELDS:
            raise LabError("A point has no time, position or velocity.")
        return cls(group, sequence, time_s, np.array(rest[:JOINTS]), np.array(rest[JOINTS : 2 * JOINTS]))


@dataclass(frozen=True)
class Feedback:
    """One group's joint positions, radians; received with all JOINTS numbers."""

    group: int
    qpos: Float[np.ndarray, "n"]

    def pack(self, order: ByteOrder) -> bytes:
        """Return the body of a JOINT_FEEDBACK."""
        numbers = [0.0, *_padded(self.qpos), *_padded([]), *_padded([])]
        return struct.pack(_SIGN[order] + "2i31f", self.group, 2, *numbers)


def feedback_of(frame: Frame, order: ByteOrder) -> tuple[Feedback, ...]:
    """Return the groups' positions in a JOINT_FEEDBACK or JOINT_FEEDBACK_EX.

    Raises LabError for another size, or if a position is not finite.
    """
    if frame.kind == Kind.JOINT_FEEDBACK:
        parts = [frame.body]
    else:
        (count,) = _numbers("i", frame.body[:4], order)
        size = (len(frame.body) - 4) // 4
        if not 1 <= count <= 4 or len(frame.body) != 4 + 4 * size:
            raise LabError(f"Joint feedback of {count} groups in {len(frame.body)} bytes.")
        parts = [frame.body[4 + k * size : 4 + (k + 1) * size] for k in range(count)]
    found = []
    for part in parts:
        group, _, _, *rest = _numbers("2i31f", part, order)
        qpos = np.array(rest[:JOINTS])
        if not np.isfinite(qpos).all():
            raise LabError("Joint feedback holds numbers that are none.")
        found.append(Feedback(group, qpos))
    return tuple(found)


def motion_ctrl(group: int, sequence: int, command: Command, order: ByteOrder) -> bytes:
    """Return the body of a MOTION_CTRL."""
    return struct.pack(_SIGN[order] + "3i10f", group, sequence, command, *_padded([]))


@dataclass(frozen=True)
class MotionReply:
    """The answer to a point or a command; `command` is that command, or the message type of the point."""

    group: int
    sequence: int
    command: int
    result: int
    subcode: int

    def pack(self, order: ByteOrder) -> bytes:
        return struct.pack(_SIGN[order] + "5i10f", *vars(self).values(), *_padded([]))

    @classmethod
    def unpack(cls, body: bytes, order: ByteOrder) -> Self:
        """Read a reply. Raises LabError for another size."""
        return cls(*_numbers("5i10f", body, order)[:5])

    @property
    def reason(self) -> str:
        """Why the request was refused, for people."""
        result = Result(self.result).name.lower() if self.result in set(Result) else f"result {self.result}"
        return SUBCODES.get(self.subcode, f"{result}, code {self.subcode}")


def _padded(values: Sequence[float] | np.ndarray) -> list[float]:
    return [*map(float, values), *[0.0] * (JOINTS - len(values))]


def _numbers(form: str, body: bytes, order: ByteOrder) -> tuple[int, ...]:
    try:
        return struct.unpack(_SIGN[order] + form, body)
    except struct.error as error:
        raise LabError(
            f"A message of simple_message with {len(body)} bytes is of another size: {error}."
        ) from None
