"""The gripper's registers, three for commands and three for its status.

Source: Robotiq 2F-85 and 2F-140 instruction manual, chapter "Control".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from torc_lab.protocols import LabError

COMMAND_REGISTER, STATUS_REGISTER, COUNT = 0x03E8, 0x07D0, 3
_ACTIVATE, _GO = 0x01, 0x08
FAULTS = {
    0x05: "an action waits until the activation is complete",
    0x07: "it must be activated before it moves",
    0x08: "it is too hot; wait until it has cooled down",
    0x0A: "the supply's voltage is too low",
    0x0B: "an automatic release is in progress",
    0x0C: "an internal fault; activate it again",
    0x0D: "its activation failed: is something between its fingers or in the way?",
    0x0E: "the motor's current is too high",
    0x0F: "an automatic release is complete; activate it again",
}


_SILENCE = 0x09
"""No command came for a second: the first answer after any pause reports it, and it is no fault."""
_BEFORE_ACTIVATION = (0x05, 0x07)


class Object(IntEnum):
    """Whether something is between the fingers (gOBJ)."""

    MOVING = 0
    STOPPED_OPENING = 1
    STOPPED_CLOSING = 2
    AT_POSITION = 3
    """As requested: nothing is between the fingers, or it was lost."""


READY = 3
"""gSTA of a gripper whose activation is complete."""


@dataclass(frozen=True)
class GripperCommand:
    """A command. Position: 0 open to 255 closed; speed and force: 0 to 255, least to most."""

    activate: bool = True
    go: bool = True
    position: int = 0
    speed: int = 255
    force: int = 0

    def __post_init__(self) -> None:
        for name in ("position", "speed", "force"):
            if not 0 <= getattr(self, name) <= 255:
                raise ValueError(f"The gripper's {name} is 0 to 255, not {getattr(self, name)}.")

    @property
    def registers(self) -> tuple[int, int, int]:
        """The registers from COMMAND_REGISTER on."""
        action = _ACTIVATE * self.activate | _GO * self.go
        return action << 8, self.position, self.speed << 8 | self.force


RESET = GripperCommand(activate=False, go=False, speed=0)
ACTIVATE = GripperCommand(activate=True, go=False, speed=0)


@dataclass(frozen=True)
class GripperStatus:
    """The gripper's status.

    `requested` is the position of the latest command that it has taken in; the other values belong to that command.
    """

    activated: bool
    going: bool
    state: int
    object: Object
    fault: int
    requested: int
    position: int

    @property
    def ready(self) -> bool:
        """Whether it may be moved."""
        return self.activated and self.state == READY

    def check(self, name: str) -> None:
        """Raise LabError if there is a fault. Before activation, "must be activated first" does not count as one."""
        code = self.fault & 0x0F
        if not self.fault or code == _SILENCE or (code in _BEFORE_ACTIVATION and not self.ready):
            return
        raise LabError(f"{name} reports fault 0x{self.fault:02X}: {FAULTS.get(code, 'see its manual')}.")


def status_of(registers: Sequence[int]) -> GripperStatus:
    """Return the status in the registers from STATUS_REGISTER on. Raises LabError if there are not three."""
    if len(registers) != COUNT or not all(0 <= r <= 0xFFFF for r in registers):
        raise LabError(f"A Robotiq gripper's status is {COUNT} registers of 16 bits, not {list(registers)}.")
    flags, fault = registers[0] >> 8, registers[1] >> 8
    return GripperStatus(
        activated=bool(flags & 0x01),
        going=bool(flags & 0x08),
        state=flags >> 4 & 0x03,
        object=Object(flags >> 6 & 0x03),
        fault=fault,
        requested=registers[1] & 0xFF,
        position=registers[2] >> 8,
    )
