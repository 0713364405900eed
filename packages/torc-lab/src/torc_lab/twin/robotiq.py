"""A simulated Robotiq gripper behind Modbus TCP or a UR's text socket, with the registers of its manual.

It moves any `Fingers` of `torc_lab.twin.base`. Faults are triggered on command.
"""

import asyncio
import socket
import threading
import time
from typing import Any, Self

from pymodbus import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from torc_lab.robotiq.registers import COMMAND_REGISTER, COUNT, READY, STATUS_REGISTER
from torc_lab.robotiq.wires import BAUD, DEVICE
from torc_lab.twin.base import Fingers, TcpTwin

_STARTS_S = 5.0
_SILENCE_S, _SILENCE = 1.0, 0x09
"""The first answer after this much silence carries this fault (manual, chapter "Control", gFLT)."""
_MUST_ACTIVATE = 0x07
_ACTIVATION_S = 0.1


class RobotiqTwin:
    """Imitates the gripper's firmware.

    Attributes:
        fault: the fault code to report, e.g. 0x0E; 0 for none.
        written: all values that were written to its registers.
    """

    def __init__(self, fingers: Fingers) -> None:
        self.fingers, self.fault = fingers, 0
        self.written: list[list[int]] = []
        self._heard_s = time.monotonic()
        self._command = [0, 0, 0]
        self._activated_at: float | None = None
        self._lock = threading.Lock()

    def write(self, offset: int, values: list[int]) -> None:
        """Write the registers from COMMAND_REGISTER + offset on, and act on them."""
        with self._lock:
            self.written.append(list(values))
            self._heard_s = time.monotonic()
            self._command[offset : offset + len(values)] = values
            action = self._command[0] >> 8
            if not action & 1:
                self._activated_at = None
            elif self._activated_at is None:
                self._activated_at = time.monotonic()
            if action & 8 and self._ready():
                speed, force = self._command[2] >> 8, self._command[2] & 0xFF
                self.fingers.go(self._command[1] & 0xFF, speed, force)

    def read(self) -> list[int]:
        """Return the registers from STATUS_REGISTER on."""
        with self._lock:
            position, found = self.fingers.now()
            action = self._command[0] >> 8
            state = 0 if self._activated_at is None else READY if self._ready() else 1
            going = bool(action & 8)
            now_s = time.monotonic()
            silent, self._heard_s = now_s - self._heard_s > _SILENCE_S, now_s
            early = _MUST_ACTIVATE if going and state != READY else 0
            fault = self.fault or (_SILENCE if silent else early)
            flags = action & 1 | going << 3 | state << 4 | (found if going else 0) << 6
            return [flags << 8, fault << 8 | self._command[1] & 0xFF, position << 8]

    def _ready(self) -> bool:
        return self._activated_at is not None and time.monotonic() - self._activated_at >= _ACTIVATION_S


class ModbusTwin:
    """Serves a twin by pymodbus during a `with`: Modbus TCP on the loopback interface, or a serial line."""

    def __init__(self, twin: RobotiqTwin, line: str = "") -> None:
        """Prepare to serve `line`, a serial port, e.g. one end of a pair of pseudo-terminals; TCP if empty."""
        self.twin, self.address = twin, line
        self._up, self._ending = threading.Event(), asyncio.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._loop.run_until_complete, args=(self._serve(),), daemon=True
        )

    def __enter__(self) -> Self:
        self._thread.start()
        if not self._up.wait(_STARTS_S):
            raise TimeoutError("The twin of the gripper did not start.")
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join()
        self._loop.close()

    async def _serve(self) -> None:
        blocks = [
            SimData(start, count=COUNT, datatype=DataType.REGISTERS)
            for start in (COMMAND_REGISTER, STATUS_REGISTER)
        ]
        device = SimDevice(DEVICE, simdata=blocks, action=self._exchange)
        server: Any
        if self.address:
            server = ModbusSerialServer(device, framer=FramerType.RTU, port=self.address, baudrate=BAUD)
            await server.listen()
        else:
            server = ModbusTcpServer(device, address=("127.0.0.1", 0))
            await server.listen()
            self.address = f"127.0.0.1:{server.transport.sockets[0].getsockname()[1]}"
        self._up.set()
        await self._ending.wait()
        await server.shutdown()

    async def _exchange(
        self, function: int, start: int, address: int, count: int, registers: list[int], values: Any
    ) -> None:
        if values and COMMAND_REGISTER <= address < COMMAND_REGISTER + COUNT:
            self.twin.write(address - COMMAND_REGISTER, list(values))
        at = STATUS_REGISTER - start
        registers[at : at + COUNT] = self.twin.read()


class UrcapTwin(TcpTwin):
    """Serves a twin during a `with`, as the text socket of the gripper's URCap on the loopback interface."""

    def __init__(self, twin: RobotiqTwin) -> None:
        super().__init__("127.0.0.1", [(0, self._serve)])
        self.twin, self.address = twin, f"127.0.0.1:{self.ports[0]}"

    def _serve(self, connection: socket.socket) -> None:
        with connection.makefile("rb") as lines:
            for line in lines:
                connection.sendall(self.answer(line.decode("ascii", "replace").split()).encode())

    def answer(self, words: list[str]) -> str:
        """Return the URCap's answer to a line."""
        if words[:1] == ["GET"] and len(words) == 2:
            flags, faults, position = self.twin.read()
            values = {
                "ACT": flags >> 8 & 1,
                "GTO": flags >> 11 & 1,
                "STA": flags >> 12 & 3,
                "OBJ": flags >> 14,
                "FLT": faults >> 8,
                "PRE": faults & 0xFF,
                "POS": position >> 8,
            }
            return f"{words[1]} {values[words[1]]}\n" if words[1] in values else "?\n"
        if words[:1] == ["SET"] and len(words) % 2 and all(w.isdigit() for w in words[2::2]):
            v = dict(zip(words[1::2], map(int, words[2::2])))
            action = v.get("ACT", 0) | v.get("GTO", 0) << 3
            self.twin.write(0, [action << 8, v.get("POS", 0), v.get("SPE", 0) << 8 | v.get("FOR", 0)])
            return "ack"
        return "?\n"
