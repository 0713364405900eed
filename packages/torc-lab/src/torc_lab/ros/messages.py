"""Messages to and from arms of ROS 1 and ROS 2, as JSON.

Several nodes may publish joint states on one topic, each of some joints: a Motoman driver publishes one message per
group, and a gripper its own. So the newest value of each joint counts, with its own age, not the newest message.
Messages may come late, twice, or out of order. The robot's clock is not this machine's; the message with the least
delay shows the difference.
"""

import threading
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from torc.records import Trajectory
from torc_lab.protocols import LabError
from torc_lab.simple_message.messages import RobotStatus

RosVersion = Literal[1, 2]
ACTION_TYPES = {
    1: "control_msgs/FollowJointTrajectory",
    2: "control_msgs/action/FollowJointTrajectory",
}
JOINT_STATE_TYPES = {1: "sensor_msgs/JointState", 2: "sensor_msgs/msg/JointState"}
_STATUS_WORDS = {
    1: {
        2: "preempted",
        4: "aborted",
        5: "rejected",
        6: "preempting",
        7: "recalling",
        8: "recalled",
        9: "lost",
    },
    2: {0: "unknown", 5: "cancelled", 6: "aborted"},
}
"""actionlib_msgs/GoalStatus less pending (0), active (1) and succeeded (3); action_msgs/GoalStatus less accepted (1),
executing (2), cancelling (3) and succeeded (4)."""
SUCCEEDED = {1: 3, 2: 4}


def goal_message(trajectory: Trajectory, joint_names: Sequence[str], ros: RosVersion) -> dict[str, Any]:
    """Return the goal of a FollowJointTrajectory: positions and velocities at every sample."""
    points = [
        {
            "positions": qpos.tolist(),
            "velocities": qvel.tolist(),
            "accelerations": [],
            "effort": [],
            "time_from_start": duration(float(t), ros),
        }
        for t, qpos, qvel in zip(trajectory.times_s, trajectory.qpos, trajectory.qvel, strict=True)
    ]
    header = {"stamp": duration(0.0, ros), "frame_id": ""}
    return {"trajectory": {"header": header, "joint_names": list(joint_names), "points": points}}


def duration(seconds: float, ros: RosVersion) -> dict[str, int]:
    """Return a time or duration as a message, rounded to nanoseconds."""
    whole, rest = divmod(round(seconds * 1e9), 10**9)
    return {"secs": whole, "nsecs": rest} if ros == 1 else {"sec": whole, "nanosec": rest}


def result_of(status: Any, text: Any, error_code: Any, ros: RosVersion) -> str | None:
    """Return how a goal ended: "" for success, else why; None while it goes on.

    For a cancelled goal only the status counts: the result's own error_code says nothing about it.
    """
    if not isinstance(status, int):
        return f"a status {status!r}, which is no number"
    if status == SUCCEEDED[ros]:
        return "" if error_code in (0, None) else f"error code {error_code}" + (f": {text}" if text else "")
    words = _STATUS_WORDS[ros].get(status)
    return None if words is None else words + (f": {text}" if text else "")


def robot_status_fault(message: Any) -> str:
    """Return why nothing moves, from an industrial_msgs/RobotStatus; "" if it may. Unknown values count as faults."""
    try:
        names = ("drives_powered", "e_stopped", "in_error", "mode", "motion_possible")
        values = {name: int(message[name]["val"]) for name in names}
    except (KeyError, TypeError, ValueError):
        return "its robot_status cannot be read"
    return RobotStatus(error_code=message.get("error_code", 0), in_motion=-1, **values).stopped


_UR_SAFETY = {
    1: "",
    2: "",  # reduced: slower, but it moves
    3: "protective stop",
    4: "recovery mode",
    5: "safeguard stop",
    6: "e-stop",
    7: "e-stop",
    8: "safety violation",
    9: "safety fault",
}


def ur_safety_fault(message: Any) -> str:
    """Return why nothing moves, from a ur_dashboard_msgs/SafetyMode; "" if it may move."""
    mode = message.get("mode") if isinstance(message, Mapping) else None
    if not isinstance(mode, int):
        return "its safety mode cannot be read"
    return _UR_SAFETY.get(mode, f"safety mode {mode}")


def is_moving(message: Any) -> bool | None:
    """Return whether an industrial_msgs/RobotStatus reports motion; None if it does not say."""
    try:
        return {0: False, 1: True}.get(int(message["in_motion"]["val"]))
    except (KeyError, TypeError, ValueError):
        return None


_LEAK = 1e-3
"""Clocks drift by far less than this; a permanently slower network is noticed at this rate."""


class Arrivals:
    """A publisher's newest message by its own time stamp, and its arrival time corrected for delays."""

    def __init__(self) -> None:
        self._message: Any = None
        self._told_s: float | None = None
        self._stamp_s = self._came_s = 0.0
        self._least_s = float("inf")

    def take(self, message: Any, came_s: float) -> tuple[Any, float]:
        """Take in one more message; return the newest and its stamp, by this machine's monotonic clock.

        A repeated message does no harm. A message without a time stamp counts as new.
        """
        told_s = stamp_of(message)
        if told_s is None:
            self._message, self._told_s, self._stamp_s = message, None, came_s
        elif self._told_s is None or told_s > self._told_s:
            least = self._least_s + _LEAK * max(0.0, came_s - self._came_s)
            self._least_s, self._came_s = min(least, came_s - told_s), came_s
            self._message, self._told_s, self._stamp_s = message, told_s, told_s + self._least_s
        return self._message, self._stamp_s


def stamp_of(message: Any) -> float | None:
    """Return the time in a message's header, seconds; None if it is missing or zero."""
    try:
        stamp = message["header"]["stamp"]
        seconds = stamp.get("secs", stamp.get("sec", 0)) + 1e-9 * stamp.get("nsecs", stamp.get("nanosec", 0))
        return float(seconds) or None
    except (TypeError, KeyError, AttributeError, ValueError, OverflowError):
        return None


class JointStates:
    """Takes in JointState messages; may be used by several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # Each publisher has a clock of its own, and sends the same names every time.
        self._publishers: dict[tuple[str, ...], Arrivals] = {}
        self._newest: dict[str, tuple[float, float]] = {}
        """Position and stamp of each joint."""
        self._unreadable = ""

    def take(self, message: Any, came_s: float) -> None:
        """Take in one message, which arrived at `came_s` by `time.monotonic`."""
        with self._lock:
            try:
                names = tuple(map(str, message["name"]))
                arrivals = self._publishers.setdefault(names, Arrivals())
                newest, stamp_s = arrivals.take(message, came_s)
                positions = [float(v) for v in newest["position"]]
            except (KeyError, TypeError, ValueError) as error:
                self._unreadable = f": {str(error) or type(error).__name__}"
                return
            # Some publish velocities or efforts alone, without positions.
            for name, position in zip(names, positions):
                if name not in self._newest or stamp_s >= self._newest[name][1]:
                    self._newest[name] = position, stamp_s

    def knows(self, joint_names: Sequence[str]) -> bool:
        """Return whether each of these joints has appeared in a message."""
        with self._lock:
            return all(name in self._newest for name in joint_names)

    def of(self, joint_names: Sequence[str]) -> tuple[Float[np.ndarray, "dof"], float]:
        """Return the positions of these joints, radians, and the oldest one's time, by `time.monotonic`.

        Raises LabError if a joint is missing or its position is not finite.
        """
        with self._lock:
            missing = [name for name in joint_names if name not in self._newest]
            if not self._newest:
                raise LabError(f"No joint states could be read{self._unreadable}.")
            if missing:
                raise LabError(
                    f"The joint states have no {', '.join(map(repr, missing))}; they have "
                    f"{', '.join(sorted(self._newest))}. Do the names in the lab file fit this robot?"
                )
            found = [self._newest[name] for name in joint_names]
        qpos = np.array([position for position, _ in found])
        if not np.isfinite(qpos).all():
            raise LabError("The joint states hold numbers that are not finite.")
        return qpos, min(stamp_s for _, stamp_s in found)

    def all(self) -> Mapping[str, float]:
        """Return the newest position of every joint that has appeared."""
        with self._lock:
            return {name: position for name, (position, _) in self._newest.items()}
