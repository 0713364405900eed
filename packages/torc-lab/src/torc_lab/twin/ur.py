"""A simulated UR controller for ur_rtde. It imitates ur_rtde's control script, but runs no script.

It serves RTDE (protocol version 2: https://www.universal-robots.com/articles/ur/interface-communication, guide
"RTDE"), the script port and the dashboard. It moves any `ArmBehind` of
`torc_lab.twin.base`. Faults are triggered on command.
"""

import socket
import struct
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from torc_lab.twin.base import ArmBehind, TcpTwin

_RTDE_PORT, _SCRIPT_PORT, _DASHBOARD_PORT = 30004, 30003, 29999
"""Fixed in ur_rtde: several twins differ by their loopback address."""
_CODES = {"DOUBLE": "d", "INT32": "i", "UINT32": "I", "VECTOR6D": "6d"}
_SLOW_RAD_S = 0.05
"""An arm that is slower may have arrived."""
_SERVO_J, _SERVO_STOP, _STOP_J, _STOP_SCRIPT = 11, 16, 34, 255
_READY, _DONE = 1, 2
_STOPPED, _PLAYING = 1, 2
_RUNNING, _POWER_OFF = 7, 3
_NORMAL, _PROTECTIVE, _E_STOP = 1, 3, 7
_SAFETY_BITS = {_NORMAL: 1, _PROTECTIVE: 1 << 2, _E_STOP: 1 << 7 | 1 << 10}
_TELLS_S = 0.008
READY: Mapping[str, Any] = {"robot_mode": _RUNNING, "safety_mode": _NORMAL, "remote": True, "slider": 1.0}
"""The reported state of a robot that may move."""
_ANSWERS = {
    "PolyscopeVersion": "URSoftware 5.11.0.108249 (Dec 01 2021)",
    "get serial number": "20215500000",
    "stop": "Stopped",
}


class UrTwin(TcpTwin):
    """Serves a controller with its arm, during a `with`.

    Attributes:
        state: the reported state; change it to press the e-stop, for example.
        silent: it publishes nothing any more.
        heard: every command except queries, as its number and arguments; the control script as ("script",).
        force_n: force on the TCP, newtons, in addition to that of contacts.
    """

    def __init__(self, arm: ArmBehind) -> None:
        """Bind a UR's ports on the first loopback address where they are free. Raises OSError if there is none."""
        self.arm, self.state, self.silent, self.force_n = arm, dict(READY), False, np.zeros(3)
        self.heard: list[tuple[Any, ...]] = []
        self._inputs: dict[str, Any] = {}
        self._program, self._told, self._executing = False, 0, False
        self._target: np.ndarray | None = None
        self._speed, self._before, self._since = np.zeros(6), arm.qpos.copy(), time.monotonic()
        self._lock = threading.RLock()
        serves = [
            (_RTDE_PORT, self._serve_rtde),
            (_SCRIPT_PORT, self._serve_script),
            (_DASHBOARD_PORT, self._serve_dashboard),
        ]
        # Not .1 if there is another: from there ur_rtde does not ask for remote control.
        for last in (*range(2, 255), 1):
            with suppress(OSError):
                return super().__init__(f"127.0.0.{last}", serves, self._live)
        raise OSError("No loopback address has the ports of a UR free.")

    def halt(self, e_stopped: int = 0, in_error: int = 0, mode: int = 2) -> None:
        """Stop the arm and its program by the e-stop, a protective stop, or the switch to local mode (mode=1)."""
        with self._lock:
            if e_stopped:
                self.state |= {"safety_mode": _E_STOP, "robot_mode": _POWER_OFF}
            if in_error:
                self.state |= {"safety_mode": _PROTECTIVE}
            if mode != 2:
                self.state |= {"remote": False}
            self._end_program()

    def recover(self) -> None:
        """End all faults; connections that were cut stay so."""
        self.state, self.silent = dict(READY), False

    def pretend_done(self) -> bool:
        """Stop the arm where it is while its program goes on; return False if the arm is not moving."""
        with self._lock:
            if self._target is None or np.abs(self._speed).max() < _SLOW_RAD_S:
                return False
            self._target = None
        return True

    def _end_program(self) -> None:
        self._program, self._target, self._told = False, None, 0

    def _serve_dashboard(self, connection: socket.socket) -> None:
        connection.sendall(b"Connected: Universal Robots Dashboard Server\n")
        with connection.makefile("r", encoding="utf-8") as lines:
            for line in map(str.strip, lines):
                if line == "stop":
                    with self._lock:
                        self._end_program()
                known = {**_ANSWERS, "is in remote control": str(self.state["remote"]).lower()}
                answer = known.get(line, f"could not understand: '{line}'")
                connection.sendall(f"{answer}\n".encode())

    def _serve_script(self, connection: socket.socket) -> None:
        text = b""
        while data := connection.recv(65536):
            text += data
            if text.endswith((b"\nend\n", b"\nend")):
                self._run(text.decode("utf-8", "replace"))
                text = b""

    def _serve_rtde(self, connection: socket.socket) -> None:
        recipes: dict[int, list[str]] = {}
        outputs: list[str] = []
        with connection.makefile("rb") as stream:
            while header := stream.read(3):
                size, kind = struct.unpack(">HB", header)
                body = stream.read(size - 3)
                match chr(kind):
                    case "V":
                        self._say(connection, "V", b"\x01")
                    case "S":
                        self._say(connection, "S", b"\x01")
                        threading.Thread(
                            target=self._publish, args=(connection, outputs), daemon=True
                        ).start()
                    case "v":
                        self._say(connection, "v", struct.pack(">4I", 5, 11, 0, 0))
                    case "O":
                        outputs = [n for n in body[8:].decode().split(",") if n]
                        self._say(connection, "O", b"\x01" + self._types(outputs))
                    case "I":
                        recipes[len(recipes) + 1] = names = [n for n in body.decode().split(",") if n]
                        self._say(connection, "I", bytes([len(recipes)]) + self._types(names))
                    case "U":
                        known = recipes.get(body[0])
                        if known is None:  # of a connection from before, which ur_rtde made again
                            return
                        values = struct.unpack(self._layout(known), body[1:])
                        self._take(dict(zip(known, values, strict=True)))

    def _publish(self, connection: socket.socket, names: Sequence[str]) -> None:
        """Publish the outputs until the connection ends."""
        layout = self._layout(names)
        with suppress(OSError):
            while self._running:
                if not self.silent:
                    told = self._outputs()
                    values = [v for n in names for v in np.ravel(told.get(n, ("", 0))[1]).tolist()]
                    self._say(connection, "U", b"\x01" + struct.pack(layout, *values))
                time.sleep(_TELLS_S)

    def _say(self, connection: socket.socket, kind: str, body: bytes) -> None:
        connection.sendall(struct.pack(">HB", 3 + len(body), ord(kind)) + body)

    def _outputs(self) -> Mapping[str, tuple[str, Any]]:
        """Return type and value of every RTDE output variable."""
        with self._lock:
            safety, mode = self.state["safety_mode"], self.state["robot_mode"]
            x, y, z = self.force_n
            return {
                "timestamp": ("DOUBLE", time.monotonic()),
                "actual_q": ("VECTOR6D", self.arm.qpos),
                "actual_qd": ("VECTOR6D", self._speed),
                "actual_TCP_force": ("VECTOR6D", [x, y, z + self.arm.contact_n, 0.0, 0.0, 0.0]),
                "robot_mode": ("INT32", mode),
                "safety_mode": ("INT32", safety),
                "runtime_state": ("UINT32", _PLAYING if self._program else _STOPPED),
                "robot_status_bits": ("UINT32", (mode == _RUNNING) | self._program << 1),
                "safety_status_bits": ("UINT32", _SAFETY_BITS.get(safety, 0)),
                "speed_scaling": ("DOUBLE", 1.0),
                "target_speed_fraction": ("DOUBLE", self.state["slider"]),
                "output_int_register_0": ("INT32", self._told),
            }

    def _type_of(self, name: str) -> str:
        """Return the type of an RTDE variable, "NOT_FOUND" if this twin does not have it."""
        registers = {"_int_register_": "INT32", "_double_register_": "DOUBLE"}
        other = self._outputs().get(name, ("NOT_FOUND", 0))[0]
        return next((kind for part, kind in registers.items() if part in name), other)

    def _types(self, names: Sequence[str]) -> bytes:
        return ",".join(map(self._type_of, names)).encode()

    def _layout(self, names: Sequence[str]) -> str:
        return ">" + "".join(_CODES[self._type_of(name)] for name in names)

    def _take(self, inputs: Mapping[str, Any]) -> None:
        with self._lock:
            self._inputs |= inputs
            if self._program and inputs.get("input_int_register_0") == _SERVO_J:
                self._obey(_SERVO_J)

    def _run(self, text: str) -> None:
        """Begin the uploaded control script. In local mode, or unpowered, a controller ignores it."""
        with self._lock:
            ready = self.state["safety_mode"] == _NORMAL and self.state["robot_mode"] == _RUNNING
            if "rtde_control" in text and ready and self.state["remote"]:
                self.heard.append(("script",))
                self._program, self._told, self._executing = True, _READY, False

    def _obey(self, command: int) -> None:
        numbers = [self._inputs.get(f"input_double_register_{k}", 0.0) for k in range(11)]
        self.heard.append((command, *numbers[: 11 if command == _SERVO_J else 1]))
        if command == _SERVO_J:
            self._target = np.array(numbers[:6])
        elif command in (_SERVO_STOP, _STOP_J):
            self._target = None
        elif command == _STOP_SCRIPT:
            self._end_program()

    def _live(self) -> None:
        """Carry out one step of the control script: answer in its registers and move the arm."""
        with self._lock:
            command = self._inputs.get("input_int_register_0", 0)
            if self._program and command == _SERVO_J:
                self._told = _READY
            elif self._program and command == 0:
                self._told, self._executing = _READY, False
            elif self._program and not self._executing:
                self._executing, self._told = True, _DONE
                self._obey(command)
            if self._target is not None:
                self.arm.goal(self._target)
            now, here = time.monotonic(), self.arm.qpos.copy()
            self._speed = (here - self._before) / max(now - self._since, 1e-6)
            self._before, self._since = here, now
