"""The `Gripper` of torc.robots.protocols for a Robotiq 2F."""

import threading
import time
from dataclasses import dataclass, field

import numpy as np

from torc import InputError
from torc.robots.protocols import GripperState
from torc_lab.protocols import LabError
from torc_lab.robotiq.registers import ACTIVATE, RESET, GripperCommand, GripperStatus, Object
from torc_lab.robotiq.wires import DEVICE, ModbusWire, UrcapWire, Wire

FORCE_N = (20.0, 235.0)
"""Least and most grip force of a 2F-85 (its data sheet)."""
_FORCE_140_N = (10.0, 125.0)
"""Least and most grip force of a 2F-140."""
_WIDE_M = 0.1
"""A gripper that opens wider is a 2F-140."""
_ACTIVATION_S, _MOTION_S, _ECHO_S = 10.0, 6.0, 0.5
_POLL_S = 0.01
_ALIVE_S = 0.2
"""Interval at which an idle gripper is polled.

After a second of silence it reports a fault. Polling also shows that another client commands it.
"""


@dataclass(frozen=True)
class WidthScale:
    """Positions (0 to 255) that the open and the closed fingers really reach; `calibrate` measures them.

    The width is linear between them.

    Attributes:
        open_count, closed_count: the positions.
        max_width_m: .085 for a 2F-85, .140 for a 2F-140.
    """

    open_count: int = 3
    closed_count: int = 230
    max_width_m: float = 0.085

    def __post_init__(self) -> None:
        if not 0 <= self.open_count < self.closed_count <= 255 or self.max_width_m <= 0:
            raise InputError(f"No widths of a gripper: {self}.")

    def width_m(self, count: int) -> float:
        """Return the opening at a position, metres."""
        share = (self.closed_count - count) / (self.closed_count - self.open_count)
        return float(np.clip(share, 0, 1)) * self.max_width_m

    @property
    def force_n(self) -> tuple[float, float]:
        """Least and most grip force of a gripper with this opening."""
        return FORCE_N if self.max_width_m < _WIDE_M else _FORCE_140_N

    def count(self, width_m: float) -> int:
        """Return the position for an opening. Raises InputError if it is out of range."""
        if not -1e-6 <= width_m <= self.max_width_m + 1e-6:
            raise InputError(f"The gripper opens 0 to {self.max_width_m} m, not {width_m} m.")
        share = width_m / self.max_width_m
        return round(self.closed_count - share * (self.closed_count - self.open_count))


@dataclass(frozen=True)
class RobotiqConfig(WidthScale):
    """Address and widths of the gripper; `torc lab check --move` measures its counts.

    Attributes:
        address: a serial port ("/dev/ttyUSB0"), or "host" or "host:port".
        device: its number on the Modbus line.
        timeout_s: for one answer.
    """

    address: str = field(kw_only=True)
    device: int = DEVICE
    timeout_s: float = 0.5


def over_modbus(config: RobotiqConfig) -> "RobotiqGripper":
    """Connect to a gripper on a serial line or Modbus TCP. Raises LabError, MissingDependencyError."""
    return RobotiqGripper(ModbusWire(config.address, config.device, config.timeout_s), config)


def over_urcap(config: RobotiqConfig) -> "RobotiqGripper":
    """Connect to a gripper behind a UR controller's URCap. Raises LabError."""
    return RobotiqGripper(UrcapWire(config.address, config.timeout_s), config)


class RobotiqGripper:
    """A connected gripper. It keeps its grip when torc ends or the connection breaks."""

    def __init__(self, wire: Wire, scale: WidthScale | None = None) -> None:
        """Check the gripper and keep it awake. Raises LabError if it reports a fault."""
        self.wire, self.scale, self.name = wire, scale or WidthScale(), wire.name
        self._closing = self._held = False
        try:
            wire.status().check(wire.name)
        except LabError:
            wire.close()
            raise
        self._ended = threading.Event()
        threading.Thread(target=self._keep_awake, name="torc-gripper", daemon=True).start()

    @property
    def max_width_m(self) -> float:
        """Largest opening between the pads."""
        return self.scale.max_width_m

    @property
    def ready(self) -> bool:
        """Whether it has been activated since power-up."""
        return self.wire.status().ready

    @property
    def state(self) -> GripperState:
        """What it feels now. Raises LabError for a fault."""
        return self._state(self._checked())

    def activate(self) -> None:
        """Activate it: **the fingers open and close all the way**. Raises LabError if it does not become ready."""
        self.wire.send(RESET)
        self.wire.send(ACTIVATE)
        began = time.monotonic()
        while not self.wire.status().ready:
            if time.monotonic() - began > _ACTIVATION_S:
                self._checked()
                raise LabError(f"{self.name} was not activated within {_ACTIVATION_S:g} s.")
            time.sleep(_POLL_S)
        self._checked()

    def open(self, width_m: float) -> GripperState:
        """Open (or close) to width_m without force. Raises LabError, and InputError for a width out of range."""
        self._closing = False
        return self._state(self._move(GripperCommand(position=self.scale.count(width_m))))

    def close(self, force_n: float) -> GripperState:
        """Close until contact, and keep pressing with about force_n, newtons. Raises LabError, InputError."""
        if force_n <= 0:
            raise InputError(f"The grip force must be positive, not {force_n} N.")
        self._closing = True
        count = round(float(np.interp(force_n, self.scale.force_n, (0, 255))))
        return self._state(self._move(GripperCommand(position=255, force=count)))

    def calibrate(self) -> WidthScale:
        """Open and close all the way, with nothing between the fingers; widths are right afterwards.

        Raises LabError if something was between them.
        """
        ends = []
        for position in (0, 255):
            status = self._move(GripperCommand(position=position))
            if status.object is Object.STOPPED_OPENING:
                raise LabError(f"{self.name} could not open: something is in its way.")
            ends.append(status.position)
        if ends[1] - ends[0] < 100:
            raise LabError(
                f"{self.name} moved from {ends[0]} to {ends[1]} of 255 only: is something between its fingers?"
            )
        self.scale = WidthScale(ends[0], ends[1], self.scale.max_width_m)
        return self.scale

    def disconnect(self) -> None:
        """End the connection; the fingers keep their grip."""
        self._ended.set()
        self.wire.close()

    def _keep_awake(self) -> None:
        """Poll the status now and then, also while the arm moves. A lost connection shows at the next call."""
        while not self._ended.wait(_ALIVE_S):
            try:
                self.wire.status()
            except LabError:
                return

    def _move(self, command: GripperCommand) -> GripperStatus:
        """Return the status once the fingers rest. A status before the command's echo belongs to the command before."""
        self.wire.send(command)
        began = time.monotonic()
        while True:
            status = self._checked()
            if not status.ready:
                raise LabError(f"{self.name} is not activated: `activate` moves its fingers all the way.")
            elapsed = time.monotonic() - began
            heard = status.requested == command.position and status.going
            if heard and status.object is not Object.MOVING:
                return status
            if not heard and elapsed > _ECHO_S:
                raise LabError(f"{self.name} did not take the command: somebody else commands it, too.")
            if elapsed > _MOTION_S:
                raise LabError(f"{self.name} still moves after {_MOTION_S:g} s.")
            time.sleep(_POLL_S)

    def _checked(self) -> GripperStatus:
        """Return the status. Raises LabError if it reports a fault."""
        status = self.wire.status()
        status.check(self.name)
        return status

    def _state(self, status: GripperStatus) -> GripperState:
        """Return the state: it holds something if it stopped while closing.

        A drop shows, as the gripper then closes all the way. While the fingers move, `holding` stays as it was: they
        follow a held object when the arm starts or stops.
        """
        stopped = status.object is Object.STOPPED_CLOSING
        self._held = self._closing and (self._held if status.object is Object.MOVING else stopped)
        return GripperState(self.scale.width_m(status.position), self._held)
