"""What is said to and heard of a trajectory controller of ROS 1 and ROS 2, as JSON."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from torc.records import Trajectory

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
    """The goal of a FollowJointTrajectory: positions and velocities at every sample."""
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
    """A time or duration, rounded to nanoseconds."""
    whole, rest = divmod(round(seconds * 1e9), 10**9)
    return {"secs": whole, "nsecs": rest} if ros == 1 else {"sec": whole, "nanosec": rest}


def result_of(status: Any, text: Any, error_code: Any, ros: RosVersion) -> str | None:
    """How a goal ended: "" for well, else why; None if it goes on. The result's own error_code says nothing about a
    goal that was cancelled: the status counts.
    """
    if not isinstance(status, int):
        return f"a status {status!r}, which is no number"
    if status == SUCCEEDED[ros]:
        return "" if error_code in (0, None) else f"error code {error_code}" + (f": {text}" if text else "")
    words = _STATUS_WORDS[ros].get(status)
    return None if words is None else words + (f": {text}" if text else "")


def robot_status_fault(message: Any) -> str:
    """Why nothing moves, by an industrial_msgs/RobotStatus; "" if it may. What is unknown does not count as well."""
    try:
        names = ("e_stopped", "drives_powered", "motion_possible", "in_error", "mode")
        value = {name: int(message[name]["val"]) for name in names}
    except (KeyError, TypeError, ValueError):
        return "its robot_status cannot be read"
    reasons = {
        "e-stop": value["e_stopped"] != 0,
        f"error {message.get('error_code', '')}".strip(): value["in_error"] != 0,
        "teach mode": value["mode"] != 2,
        "the drives are off": value["drives_powered"] != 1,
        "it is not ready for motion": value["motion_possible"] != 1,
    }
    return next((text for text, true in reasons.items() if true), "")


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
    """Why nothing moves, by a ur_dashboard_msgs/SafetyMode; "" if it may."""
    mode = message.get("mode") if isinstance(message, Mapping) else None
    if not isinstance(mode, int):
        return "its safety mode cannot be read"
    return _UR_SAFETY.get(mode, f"safety mode {mode}")


def is_moving(message: Any) -> bool | None:
    """Whether the robot says that it moves, by an industrial_msgs/RobotStatus; None if it does not say."""
    try:
        return {0: False, 1: True}.get(int(message["in_motion"]["val"]))
    except (KeyError, TypeError, ValueError):
        return None
