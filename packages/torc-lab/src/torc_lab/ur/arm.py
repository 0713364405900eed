"""The `ArmDriver` of a Universal Robots arm (CB3 and e-Series), by ur_rtde."""

import itertools
import json
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline

from torc import InputError
from torc.errors import MissingDependencyError, extra_remedy
from torc.records import Trajectory
from torc_lab.exclusive import ControllerLock
from torc_lab.link import Link
from torc_lab.protocols import ArmStatus, LabError
from torc_lab.ros.messages import ur_safety_fault

_DOF = 6
_RUNNING = 7
_MODES = {
    -1: "its controller is not connected",
    0: "its controller is not connected",
    1: "its safety settings wait to be confirmed",
    2: "it starts up",
    3: "its power is off",
    4: "it is not initialised",
    5: "its brakes are on",
    6: "its brakes are released by hand",
    8: "its firmware is being updated",
}
"""The fault that each robot mode other than running means (RTDE guide, robot_mode)."""
_MOVING_RAD_S = 0.01
_SLIDER = 0.995
_ENDS_S = 3.0


@dataclass(frozen=True)
class UrConfig:
    """Address of the robot, and how it follows set points.

    Attributes:
        host: its name or address.
        rate_hz: set points per second. 125 suits all; an e-Series takes up to 500.
        lookahead_s, gain: of servoJ: how far ahead the controller smooths (.03 to .2 s), and how stiffly it follows
            (100 to 2000).
        feels_contact: whether to rely on the force on the TCP. The e-Series measures it; a CB3 estimates it from its
            motors' currents, which is too rough for a guard.
        timeout_s: how long to wait for the robot's first state, and for a motion to begin.
    """

    host: str
    rate_hz: float = 125.0
    lookahead_s: float = 0.1
    gain: float = 300.0
    feels_contact: bool = True
    timeout_s: float = 8.0

    def __post_init__(self) -> None:
        if not (50 <= self.rate_hz <= 500 and 0.03 <= self.lookahead_s <= 0.2 and 100 <= self.gain <= 2000):
            raise InputError("UrConfig: rate_hz is 50 to 500, lookahead_s .03 to .2, gain 100 to 2000.")
        if not self.host or not self.timeout_s > 0:
            raise InputError("UrConfig: a host, and a timeout_s above 0.")


class UrArm(Link):
    """A UR in remote control. The first motion uploads ur_rtde's program, and ends any program that runs.

    Set points are streamed (servoJ), so that path and speed are those that were checked, and a robot that no longer
    hears from torc rests at the last one. Contact is the force on the TCP beyond that at the start of the motion:
    payload and centre of gravity must be set at the pendant.
    """

    start_tolerance_rad = 2e-3

    def __init__(self, config: UrConfig, dof: int = _DOF) -> None:
        """Connect and wait for the first state; nothing moves.

        Raises LabError, InputError, MissingDependencyError.
        """
        if dof != _DOF:
            raise InputError(f"A UR has {_DOF} joints; the robot description has {dof}.")
        if find_spec("rtde_control") is None:
            raise MissingDependencyError("ur_rtde, for arms of Universal Robots,", extra_remedy("ur"))
        super().__init__(f"UR at {config.host}")
        self.config, self.feels_contact = config, config.feels_contact
        self._state: tuple[Any, ...] | None = None
        self._lock: ControllerLock | None = None
        self._numbers, self._latest, self._begun = itertools.count(1), 0, 0
        self._ended: str | None = ""
        self._untouched_n = np.zeros(3)
        numbers = (config.rate_hz, config.lookahead_s, config.gain)
        command = [sys.executable, "-m", "torc_lab.ur.session", config.host, *map(str, numbers)]
        pipe = subprocess.PIPE
        # A session of its own: Ctrl-C in the terminal is torc's to handle.
        self._process: Any = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, start_new_session=True
        )
        self._sending = threading.RLock()
        self._reader = threading.Thread(target=self._read, name="torc-ur", daemon=True)
        self._reader.start()
        if not self._await(lambda: self._state is not None, config.timeout_s):
            self._lose(f"it said nothing within {config.timeout_s:g} s")
            self.close()
            raise LabError(
                f"{self.name} cannot be reached: {self.lost}. Is it on, and its RTDE interface not taken by "
                "EtherNet/IP or PROFINET?"
            )

    def status(self) -> ArmStatus:
        """Return the latest status. Raises LabError if the connection is lost."""
        with self._news:
            self._check()
            assert self._state is not None
            stamp_s, qpos, fastest, force, mode, safety, slider = self._state
            moving = self._ended is None or fastest > _MOVING_RAD_S
            beyond_n = float(np.linalg.norm(np.array(force) - self._untouched_n))
            contact_n = beyond_n if self.feels_contact else 0.0
        return ArmStatus(stamp_s, np.array(qpos), moving, ur_fault(mode, safety, slider), contact_n)

    def start(self, trajectory: Trajectory) -> None:
        """Hand over the set points, and wait until the first is sent. Raises LabError if the robot refuses."""
        points = set_points(trajectory, self.config.rate_hz)
        self._lock = self._lock or ControllerLock(f"ur-{self.config.host}")
        with self._news:
            self._check()
            assert self._state is not None
            if np.abs(points[0] - np.array(self._state[1])).max() > self.start_tolerance_rad:
                raise LabError(f"{self.name} is not where the motion begins.")
            self._latest, self._ended = next(self._numbers), None
            self._untouched_n = np.array(self._state[3])
        self._send({"move": self._latest, "points": np.round(points, 7).tolist()})
        begun = lambda: self._begun == self._latest or self._ended is not None  # noqa: E731
        if not self._await(begun, self.config.timeout_s):
            self.stop()
            raise LabError(f"{self.name} did not begin the motion.")
        if self._begun != self._latest:
            raise LabError(f"{self.name} refuses the motion: {self._ended}.")

    def ended(self) -> str | None:
        """Return None until all set points are sent and the arm has settled. Raises LabError if it is lost."""
        self._check()
        return self._ended

    def stop(self) -> None:
        """Send no more set points and brake (servoStop). Raises LabError if the request cannot be sent."""
        self._send({"stop": True})

    def close(self) -> None:
        """Stop, and end the program on the robot and the connection."""
        self._lose("it was closed")
        with suppress(OSError), self._sending:
            self._process.stdin.close()
        try:
            self._process.wait(_ENDS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._process.stdout.close()
        if self._lock is not None:
            self._lock.release()

    def _send(self, message: dict[str, Any]) -> None:
        self._check()
        try:
            with self._sending:
                self._process.stdin.write(json.dumps(message).encode() + b"\n")
                self._process.stdin.flush()
        except (OSError, ValueError) as error:
            raise LabError(f"{self.name} is lost: {self.lost or error}.") from error

    def _read(self) -> None:
        """Take in the messages of the session."""
        why = "the process that speaks to it ended"
        for line in self._process.stdout:
            try:
                message = json.loads(line)
                with self._news:
                    if "state" in message:
                        self._state = tuple(message["state"])
                    elif "begun" in message:
                        self._begun = message["begun"]
                    elif message.get("ended") == self._latest:
                        self._ended = message["why"]
                    why = message.get("lost", why)
                    self._news.notify_all()
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                why = f"its session wrote nonsense: {error}"
                self._process.kill()
        self._lose(why)


def ur_fault(mode: int, safety: int, slider: float) -> str:
    """Return why a UR does not move, from its robot mode, safety mode and speed slider; "" if it does.

    A slider below full speed counts: the robot would fall behind its set points.
    """
    if fault := ur_safety_fault({"mode": safety}):
        return fault
    if mode != _RUNNING:
        return _MODES.get(mode, f"robot mode {mode}")
    if slider < _SLIDER:
        return f"its speed slider is at {slider:.0%}; set it to 100 %, and the speed in the lab file"
    return ""


def set_points(trajectory: Trajectory, rate_hz: float) -> Float[np.ndarray, "n dof"]:
    """Return a trajectory's positions, one per period, both ends included.

    Between samples they are on the cubic through positions and velocities.
    """
    times = trajectory.times_s - trajectory.times_s[0]
    at = np.append(np.arange(0, times[-1], 1 / rate_hz), times[-1])
    return np.asarray(CubicHermiteSpline(times, trajectory.qpos, trajectory.qvel)(at))
