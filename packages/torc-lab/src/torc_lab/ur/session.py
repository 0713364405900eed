"""The process that drives a UR, by ur_rtde: one robot, lines of JSON in and out. `UrArm` starts and ends it.

It is a separate process because of three faults of ur_rtde (1.6.5). It restores a lost connection by itself, uploads
its program again and repeats the interrupted command; it sometimes crashes in doing so; and it blocks Python while it
connects. This process ends at the first sign of a lost connection. A UR that gets no more set points rests at the last.

In:  {"move": number, "points": [[rad, ...], ...]}, one set point per period; {"stop": true}. End of input: stop.
Out: {"state": [stamp_s, qpos, fastest, force, robot_mode, safety_mode, slider]}, {"begun": number},
     {"ended": number, "why": ""}, {"lost": why}.
"""

import json
import math
import os
import sys
import threading
import time
from typing import Any

VARIABLES = [
    "timestamp",
    "actual_q",
    "actual_qd",
    "actual_TCP_force",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "robot_status_bits",
    "safety_status_bits",
    "speed_scaling",
    "target_speed_fraction",
]
_SILENT_S = {True: 0.5, False: 3.0}
"""The process ends after this silence, with and without a motion under way; the supervisor stops the motion sooner."""
_BLIND_S = 0.1
_NEWS_S = 0.25
"""A connection that ends may fail a set point this much earlier than ur_rtde reports it."""
_PROGRAM_S = 3.0
_SETTLED_RAD, _SETTLED_RAD_S, _SETTLE_S = 0.002, 0.005, 1.0
_SPEED = _ACCELERATION = 0.5
"""Arguments of servoJ that ur_rtde does not use."""
_STOP_M_S2 = 10.0


class Session:
    """A connection to a robot. Nothing is uploaded before the first motion."""

    def __init__(self, host: str, rate_hz: float, lookahead_s: float, gain: float, out: Any) -> None:
        from rtde_receive import RTDEReceiveInterface

        self.host, self.rate_hz, self.lookahead_s, self.gain = host, rate_hz, lookahead_s, gain
        self._out, self._out_lock = out, threading.Lock()
        self._receive = RTDEReceiveInterface(host, rate_hz, VARIABLES)
        self._control: Any = None
        self._cancelled = threading.Event()
        self._mover = threading.Thread()
        threading.Thread(target=self._watch, daemon=True).start()

    def obey(self, request: dict[str, Any]) -> None:
        """Begin a motion, or stop."""
        self._cancelled.set()
        if "move" not in request:
            return
        if self._mover.is_alive():
            self._mover.join()
        self._cancelled = threading.Event()
        work = request["move"], request["points"], self._cancelled
        self._mover = threading.Thread(target=self._move, args=work, daemon=True)
        self._mover.start()

    def end(self) -> None:
        """Stop, and end the program on the robot."""
        self._cancelled.set()
        if self._mover.is_alive():
            self._mover.join()
        if self._control is not None and self._receive.isConnected():
            self._control.stopScript()

    def say(self, message: dict[str, Any]) -> None:
        """Write one line."""
        with self._out_lock:
            self._out.write(json.dumps(message).encode() + b"\n")
            self._out.flush()

    def _watch(self) -> None:
        """Write the robot's state as it comes; end the process when no more comes."""
        receive, before, since = self._receive, -1.0, time.monotonic()
        looked = since
        while True:
            now, stamp = time.monotonic(), receive.getTimestamp()
            if now - looked > _BLIND_S:  # ur_rtde kept this thread waiting: that is not the robot's silence
                since = now
            looked = now
            self._lose_if_cut()
            if now - since > _SILENT_S[self._mover.is_alive()]:
                self._lose("it fell silent")
            if stamp != before:
                before, since = stamp, now
                fastest, force = max(map(abs, receive.getActualQd())), receive.getActualTCPForce()[:3]
                modes = receive.getRobotMode(), receive.getSafetyMode(), receive.getTargetSpeedFraction()
                self.say({"state": [now, receive.getActualQ(), fastest, force, *modes]})
            time.sleep(0.5 / self.rate_hz)

    def _lose_if_cut(self) -> None:
        if not self._receive.isConnected():
            self._lose("the robot ended the connection")

    def _lose(self, why: str) -> None:
        self.say({"lost": why})
        os._exit(1)

    def _move(self, number: int, points: list[list[float]], cancelled: threading.Event) -> None:
        try:
            why = self._program() or self._stream(number, points, cancelled)
        except Exception as error:  # ur_rtde raises whatever C++ has
            why = str(error) or type(error).__name__
        self.say({"ended": number, "why": why})

    def _program(self) -> str:
        """Make ur_rtde's program run on the robot; return why it does not, or ""."""
        from rtde_control import RTDEControlInterface

        if self._control is None:
            self._control = RTDEControlInterface(self.host, self.rate_hz)
        if self._control.isProgramRunning():
            return ""
        self._control.reuploadScript()
        deadline = time.monotonic() + _PROGRAM_S
        while not self._control.isProgramRunning():
            if time.monotonic() > deadline:
                return "its program does not start. Is the robot in remote control, are its brakes released?"
            time.sleep(0.01)
        return ""

    def _stream(self, number: int, points: list[list[float]], cancelled: threading.Event) -> str:
        """Send one set point per period; return why it ended early, or ""."""
        period_s, goal = 1 / self.rate_hz, points[-1]
        held = len(points) + math.ceil(self.lookahead_s * self.rate_hz)
        due, k = time.monotonic(), 0
        while not cancelled.is_set():
            self._lose_if_cut()
            point = points[min(k, len(points) - 1)]
            if not self._control.servoJ(point, _SPEED, _ACCELERATION, period_s, self.lookahead_s, self.gain):
                return self._stopped()
            if k == 0:
                self.say({"begun": number})
            k += 1
            if k >= held and (self._settled(goal) or k > held + _SETTLE_S * self.rate_hz):
                break
            # Who is late goes on from there: set points that come in a heap would be a jump.
            due = max(due + period_s, time.monotonic() - period_s)
            time.sleep(max(0.0, due - time.monotonic()))
        stopped = self._control.servoStop(_STOP_M_S2)
        if cancelled.is_set():
            return "torc stopped it"
        return "" if stopped else self._stopped()

    def _stopped(self) -> str:
        """Return why no more set points are accepted; end the process if the connection has ended."""
        deadline = time.monotonic() + _NEWS_S
        while time.monotonic() < deadline:
            self._lose_if_cut()
            time.sleep(0.01)
        return "its program was stopped"

    def _settled(self, goal: list[float]) -> bool:
        away = max(abs(a - b) for a, b in zip(self._receive.getActualQ(), goal, strict=True))
        return away < _SETTLED_RAD and max(map(abs, self._receive.getActualQd())) < _SETTLED_RAD_S


def main(arguments: list[str]) -> None:
    """Serve until the input ends. Arguments: host, rate_hz, lookahead_s, gain."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # ur_rtde prints there
    host = arguments[0]
    rate_hz, lookahead_s, gain = map(float, arguments[1:])
    try:
        session = Session(host, rate_hz, lookahead_s, gain, out)
    except Exception as error:  # ur_rtde raises whatever C++ has
        out.write(json.dumps({"lost": str(error) or type(error).__name__}).encode() + b"\n")
        out.flush()
        os._exit(1)
    for line in sys.stdin:
        session.obey(json.loads(line))
    session.end()
    os._exit(0)  # ur_rtde's threads may hang


if __name__ == "__main__":
    main(sys.argv[1:])
