"""A UR controller that is none, as ur_rtde sees one: it runs what ur_rtde's control script does, and never a script.

Its arm is anybody's (`torc_lab.twin.behind`). Faults come on command.
"""

import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Self

import numpy as np

from torc_lab.twin.behind import ArmBehind
from torc_lab.twin.rtde import UrWires

_SLOW_RAD_S = 0.05
"""An arm that is slower may have arrived."""
_SERVO_J, _SERVO_STOP, _STOP_J, _STOP_SCRIPT = 11, 16, 34, 255
_READY, _DONE = 1, 2
_STOPPED, _PLAYING = 1, 2
_RUNNING, _POWER_OFF = 7, 3
_NORMAL, _PROTECTIVE, _E_STOP = 1, 3, 7
_PERIOD_S = 0.004
READY: Mapping[str, Any] = {"robot_mode": _RUNNING, "safety_mode": _NORMAL, "remote": True, "slider": 1.0}
"""What a robot says of itself that may move."""


class UrTwin:
    """A controller with its arm; in a `with`.

    Attributes:
        state: what it says of itself; change it to press the e-stop, say.
        heard: every command that is no question, by its number and arguments; the control script as ("script",).
        force_n: on the TCP, beside that of contacts.
    """

    def __init__(self, arm: ArmBehind) -> None:
        """Takes the first loopback address whose ports of a UR are free. Raises OSError if there is none."""
        self.arm, self.state, self.force_n = arm, dict(READY), np.zeros(3)
        self.heard: list[tuple[Any, ...]] = []
        self._inputs: dict[str, Any] = {}
        self._program, self._told, self._executing = False, 0, False
        self._target: np.ndarray | None = None
        self._speed = np.zeros(6)
        self._lock = threading.RLock()
        self._running = True
        self._wires = self._connected()
        self._thread = threading.Thread(target=self._live, name="torc-twin-ur", daemon=True)

    def _connected(self) -> UrWires:
        # Not .1 if there is another: from there ur_rtde does not ask for remote control.
        for last in (*range(2, 255), 1):
            with suppress(OSError):
                return UrWires(f"127.0.0.{last}", self._outputs, self._take, self._run, self._order)
        raise OSError("No loopback address has the ports of a UR free.")

    def __enter__(self) -> Self:
        self._wires.__enter__()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self._wires.__exit__()
        self._thread.join()

    @property
    def host(self) -> str:
        """For ur_rtde."""
        return self._wires.host

    @property
    def silent(self) -> bool:
        """Whether it tells nothing any more."""
        return self._wires.silent

    @silent.setter
    def silent(self, value: bool) -> None:
        self._wires.silent = value

    @property
    def moving(self) -> bool:
        """Whether it follows a set point."""
        return self._target is not None

    def cut(self) -> None:
        """Ends all connections without a farewell."""
        self._wires.cut()

    def halt(self, e_stopped: int = 0, in_error: int = 0, mode: int = 2) -> None:
        """Stops the arm and its program: by the e-stop, in a protective stop, or by the key to local mode (1)."""
        with self._lock:
            if e_stopped:
                self.state |= {"safety_mode": _E_STOP, "robot_mode": _POWER_OFF}
            if in_error:
                self.state |= {"safety_mode": _PROTECTIVE}
            if mode != 2:
                self.state |= {"remote": False}
            self._end_program()

    def pretend_done(self) -> bool:
        """Stops the arm where it is, while its program goes on; False if it is not halfway."""
        with self._lock:
            if self._target is None or np.abs(self._speed).max() < _SLOW_RAD_S:
                return False
            self._target = None
        return True

    def _end_program(self) -> None:
        self._program, self._target, self._told = False, None, 0

    def _outputs(self) -> Mapping[str, Any]:
        with self._lock:
            safety = self.state["safety_mode"]
            bits = {_NORMAL: 1, _PROTECTIVE: 1 << 2, _E_STOP: 1 << 7 | 1 << 10}.get(safety, 0)
            return {
                "timestamp": time.monotonic(),
                "actual_q": self.arm.qpos,
                "actual_qd": self._speed,
                "actual_TCP_force": [
                    *(self.force_n + np.array([0.0, 0.0, self.arm.contact_n])),
                    0.0,
                    0.0,
                    0.0,
                ],
                "robot_mode": self.state["robot_mode"],
                "safety_mode": safety,
                "runtime_state": _PLAYING if self._program else _STOPPED,
                "robot_status_bits": (self.state["robot_mode"] == _RUNNING) | self._program << 1,
                "safety_status_bits": bits,
                "speed_scaling": 1.0,
                "target_speed_fraction": self.state["slider"],
                "output_int_register_0": self._told,
            }

    def _take(self, inputs: Mapping[str, Any]) -> None:
        with self._lock:
            self._inputs |= inputs
            if self._program and inputs.get("input_int_register_0") == _SERVO_J:
                self._obey(_SERVO_J)

    def _run(self, text: str) -> None:
        """The control script was uploaded. In local mode, or unpowered, a controller ignores it."""
        with self._lock:
            ready = self.state["safety_mode"] == _NORMAL and self.state["robot_mode"] == _RUNNING
            if "rtde_control" in text and ready and self.state["remote"]:
                self.heard.append(("script",))
                self._program, self._told, self._executing = True, _READY, False

    def _order(self, line: str) -> str:
        if line == "PolyscopeVersion":
            return "URSoftware 5.11.0.108249 (Dec 01 2021)"
        if line == "get serial number":
            return "20215500000"
        if line == "is in remote control":
            return str(self.state["remote"]).lower()
        if line == "stop":
            with self._lock:
                self._end_program()
            return "Stopped"
        return f"could not understand: '{line}'"

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
        """What ur_rtde's control script does with its registers, and the arm."""
        before, since = self.arm.qpos.copy(), time.monotonic()
        while self._running:
            time.sleep(_PERIOD_S)
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
                self._speed, before, since = (here - before) / (now - since), here, now
