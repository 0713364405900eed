"""The `Gripper` of torc.robots.protocols for a Franka hand, by the actions of franka_gripper (ROS 2) over rosbridge."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from torc import InputError
from torc.robots.protocols import GripperState
from torc_lab.protocols import LabError
from torc_lab.ros.messages import JOINT_STATE_TYPES, result_of
from torc_lab.rosbridge.client import Rosbridge

MAX_FORCE_N = 70.0
"""Largest continuous force of the hand (its product manual)."""
_EMPTY_M = 0.0015
_OLD_S = 1.0
"""Finger positions older than this are not used."""
_POLL_S = 0.01


@dataclass(frozen=True)
class FrankaHandConfig:
    """Address and speed of the hand.

    Attributes:
        url: address of rosbridge.
        name: of its node: actions NAME/move, NAME/grasp and NAME/homing, topic NAME/joint_states.
        max_width_m: largest opening between the pads.
        speed_m_s: between the pads.
        timeout_s: how long to wait for an answer.
        motion_s: how long a motion may take.
    """

    url: str
    name: str = "/franka_gripper"
    max_width_m: float = 0.08
    speed_m_s: float = 0.1
    timeout_s: float = 5.0
    motion_s: float = 10.0

    def __post_init__(self) -> None:
        if not (0 < self.max_width_m <= 0.2 and 0 < self.speed_m_s <= 0.2):
            raise InputError("FrankaHandConfig: max_width_m and speed_m_s are above 0, and at most .2.")


class FrankaHand:
    """A hand behind rosbridge. It keeps its grip when torc ends or the connection breaks.

    It must be homed once after power-up, which moves its fingers all the way; it does not report whether that was done.
    """

    def __init__(self, config: FrankaHandConfig) -> None:
        """Connect and wait for the fingers' positions. Raises LabError, MissingDependencyError."""
        self.config, self.name = config, f"the hand {config.name} at {config.url}"
        self.max_width_m, self._topic, self._closed = config.max_width_m, f"{config.name}/joint_states", False
        self._bridge = Rosbridge(config.url, config.timeout_s)
        try:
            self._bridge.subscribe(self._topic, JOINT_STATE_TYPES[2])
            self._bridge.receive(self._topic)
            self._width_m()
        except LabError as error:
            self._bridge.close()
            raise LabError(f"{self.name} does not tell its state: {error}") from error

    @property
    def state(self) -> GripperState:
        """What it feels now. After `close` it keeps closing, so that a drop shows. Raises LabError."""
        width_m = self._width_m()
        return GripperState(width_m, self._closed and width_m > _EMPTY_M)

    def activate(self) -> None:
        """Home the hand: **the fingers open and close all the way**. Raises LabError."""
        self._closed = False
        self._act("homing", "Homing", {})

    def open(self, width_m: float) -> GripperState:
        """Open (or close) to width_m without force. Raises LabError, and InputError for a width out of range."""
        if not -1e-6 <= width_m <= self.max_width_m + 1e-6:
            raise InputError(f"The gripper opens 0 to {self.max_width_m} m, not {width_m} m.")
        self._closed = False
        width_m = float(np.clip(width_m, 0.0, self.max_width_m))
        self._act("move", "Move", {"width": width_m, "speed": self.config.speed_m_s})
        return self.state

    def close(self, force_n: float) -> GripperState:
        """Close until contact, and keep pressing with force_n, at most MAX_FORCE_N. Raises LabError, InputError."""
        if force_n <= 0:
            raise InputError(f"The grip force must be positive, not {force_n} N.")
        # Whatever the width is at which it stops, it is a grasp: what is between the pads is told by the width.
        any_width = {"inner": self.max_width_m, "outer": self.max_width_m}
        grasp = {"width": 0.0, "epsilon": any_width, "speed": self.config.speed_m_s}
        self._act("grasp", "Grasp", {**grasp, "force": float(min(force_n, MAX_FORCE_N))})
        self._closed = True
        return self.state

    def disconnect(self) -> None:
        """End the connection; the fingers keep their grip."""
        self._bridge.close()

    def _act(self, action: str, kind: str, goal: Mapping[str, Any]) -> None:
        """Run an action; return once it has succeeded. Raises LabError."""
        sent = self._bridge.send_goal(f"{self.config.name}/{action}", f"franka_msgs/action/{kind}", goal)
        deadline = time.monotonic() + self.config.motion_s
        while (result := self._bridge.goal_result(sent)) is None:
            if time.monotonic() > deadline:
                raise LabError(f"{self.name}: {action} did not end within {self.config.motion_s:g} s.")
            time.sleep(_POLL_S)
        before, (status, values) = self._bridge.latest(self._topic).count, result
        ended = result_of(status, values.get("error"), None, 2)
        if ended is None or ended or values.get("success") is False:
            why = ended or values.get("error") or "it says that it did not succeed"
            raise LabError(f"{self.name}: {action}: {why}.")
        self._bridge.receive(self._topic, before)  # one that was told after the end

    def _width_m(self) -> float:
        latest = self._bridge.latest(self._topic)
        if time.monotonic() - latest.stamp_s > _OLD_S:
            raise LabError(f"{self.name} is silent: nothing new on {self._topic}.")
        try:
            fingers = [float(p) for p in latest.message["position"]]
        except (KeyError, TypeError, ValueError) as error:
            raise LabError(f"{self.name}: its joint states cannot be read: {error}.") from None
        if len(fingers) != 2 or not np.isfinite(fingers).all():
            raise LabError(f"{self.name}: its joint states hold {fingers}, not the positions of two fingers.")
        return float(np.clip(sum(fingers), 0.0, self.max_width_m))
