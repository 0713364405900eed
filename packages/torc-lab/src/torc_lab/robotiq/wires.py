"""Connections to the gripper: Modbus over a serial line or TCP, or the socket that its program opens on a UR."""

import socket
import threading
from typing import Any, Protocol

from torc.errors import MissingDependencyError, extra_remedy
from torc_lab.link import Link
from torc_lab.protocols import LabError
from torc_lab.robotiq.registers import (
    COMMAND_REGISTER,
    COUNT,
    STATUS_REGISTER,
    GripperCommand,
    GripperStatus,
    Object,
    status_of,
)

DEVICE, BAUD = 9, 115_200
URCAP_PORT = 63352
_TIMEOUT_S = 0.5
_MOST_BYTES = 256
_ILLEGAL_FUNCTION = 1
"""Modbus exception: the device does not know the function code."""
_QUIET_S = 0.05
"""An answer without an end of line is complete after this much silence."""


class Wire(Protocol):
    """One exchange at a time; raises LabError if the gripper is gone, does not answer, or its answer is invalid."""

    name: str

    def send(self, command: GripperCommand) -> None:
        """Send a command to the gripper."""

    def status(self) -> GripperStatus:
        """Request the gripper's status."""

    def close(self) -> None:
        """End the connection."""


class ModbusWire(Link):
    """Modbus RTU on a serial port ("/dev/ttyUSB0"), or Modbus TCP at "host" or "host:port"."""

    def __init__(self, address: str, device: int = DEVICE, timeout_s: float = _TIMEOUT_S) -> None:
        """Connect. Raises LabError, MissingDependencyError."""
        try:
            from pymodbus.client import ModbusSerialClient, ModbusTcpClient
        except ImportError as error:
            raise MissingDependencyError("pymodbus, for Robotiq grippers,", extra_remedy("lab")) from error
        super().__init__(f"Robotiq gripper at {address}")
        self._device, self._lock, self._read = device, threading.Lock(), "read_input_registers"
        self._client: Any
        if address.startswith(("/", "COM")):
            self._client = ModbusSerialClient(address, baudrate=BAUD, timeout=timeout_s, retries=1)
        else:
            host, port = _host_port(address, 502)
            self._client = ModbusTcpClient(host, port=port, timeout=timeout_s, retries=1)
        if not self._client.connect():
            raise LabError(f"{self.name} cannot be reached. Is it on, and nobody else connected to it?")

    def send(self, command: GripperCommand) -> None:
        """Write the three registers."""
        self._accepted(self._exchange("write_registers", COMMAND_REGISTER, list(command.registers)))

    def status(self) -> GripperStatus:
        """Read the three registers, as input registers or, if a gateway does not know these, as holding registers.

        The gripper has equal values in both.
        """
        answer = self._exchange(self._read, STATUS_REGISTER, count=COUNT)
        if answer.isError() and getattr(answer, "exception_code", 0) == _ILLEGAL_FUNCTION:
            self._read = "read_holding_registers"
            answer = self._exchange(self._read, STATUS_REGISTER, count=COUNT)
        return status_of(self._accepted(answer).registers)

    def close(self) -> None:
        with self._lock:
            self._lose("it was closed")
            self._client.close()

    def _accepted(self, answer: Any) -> Any:
        if answer.isError():
            raise LabError(f"{self.name} refuses: {answer}")
        return answer

    def _exchange(self, function: str, *arguments: Any, **options: Any) -> Any:
        """Return the answer to one request, which may be a refusal. Raises LabError if none comes."""
        from pymodbus.exceptions import ModbusException

        with self._lock:
            self._check()
            try:
                return getattr(self._client, function)(*arguments, device_id=self._device, **options)
            except (ModbusException, OSError) as error:
                # On a serial line a late answer could not be told from the next one.
                self._client.close()
                raise self._lose(f"it does not answer: {error}") from error


class UrcapWire(Link):
    """The text socket of Robotiq's program on a UR controller (URCap), at "host" or "host:port"."""

    def __init__(self, address: str, timeout_s: float = _TIMEOUT_S) -> None:
        """Connect. Raises LabError."""
        super().__init__(f"Robotiq gripper at {address} (URCap)")
        self._lock, self._timeout_s = threading.Lock(), timeout_s
        try:
            self._socket = socket.create_connection(_host_port(address, URCAP_PORT), timeout_s)
        except OSError as error:
            raise LabError(
                f"{self.name} cannot be reached: {error}. Is the URCap installed, and the robot on?"
            ) from error

    def send(self, command: GripperCommand) -> None:
        """Set the variables, position last."""
        c = command
        answer = self._ask(
            f"SET ACT {c.activate:d} GTO {c.go:d} SPE {c.speed} FOR {c.force} POS {c.position}"
        )
        if answer != "ack":
            raise self._end(f"it answered {answer!r} to a command, not 'ack'")

    def status(self) -> GripperStatus:
        """Request the variables, one by one: "PRE" echoes the requested position."""
        v = {name: self._value(name) for name in ("ACT", "GTO", "STA", "OBJ", "FLT", "PRE", "POS")}
        if v["OBJ"] not in set(Object):
            raise self._end(f"it tells of an object state {v['OBJ']}, which there is not")
        active, going = bool(v["ACT"]), bool(v["GTO"])
        return GripperStatus(active, going, v["STA"], Object(v["OBJ"]), v["FLT"], v["PRE"], v["POS"])

    def close(self) -> None:
        self._end("it was closed")

    def _value(self, name: str) -> int:
        answer = self._ask(f"GET {name}")
        key, _, value = answer.partition(" ")
        if key != name or not (value.isascii() and value.isdigit()) or int(value) > 0xFF:
            raise self._end(f"it answered {answer!r} to GET {name}")
        return int(value)

    def _ask(self, line: str) -> str:
        """Return the answer, without its end. The first fault loses the connection for good.

        A later answer could belong to any request.
        """
        with self._lock:
            self._check()
            try:
                self._socket.sendall(line.encode() + b"\n")
                return self._answer().decode("ascii", "replace").strip()
            except OSError as error:
                raise self._end(f"it does not answer: {error}") from error

    def _answer(self) -> bytes:
        """Return an answer up to the end of its line. Raises OSError.

        "ack" has no end of line, and in some versions neither have numbers: these end when nothing more comes.
        """
        answer = b""
        while not answer.endswith((b"\n", b"ack")) and len(answer) < _MOST_BYTES:
            self._socket.settimeout(_QUIET_S if answer.strip() else self._timeout_s)
            try:
                part = self._socket.recv(_MOST_BYTES)
            except TimeoutError:
                if answer.strip():
                    return answer
                raise
            if not part:
                raise OSError("it ended the connection")
            answer += part
        return answer

    def _end(self, why: str) -> LabError:
        self._socket.close()
        return self._lose(why)


def _host_port(address: str, usual: int) -> tuple[str, int]:
    host, _, port = address.partition(":")
    if port and not (port.isdigit() and 0 < int(port) < 65536):
        raise LabError(f"{address} is no address: host or host:port.")
    return host, int(port or usual)
