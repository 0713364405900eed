"""The `ArmDriver` of a FollowJointTrajectory controller, by rosbridge: ROS 1 and ROS 2."""

import itertools
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from torc import InputError
from torc.records import Trajectory
from torc_lab.checks import thinned
from torc_lab.exclusive import ControllerLock
from torc_lab.protocols import ArmStatus, LabError
from torc_lab.ros.messages import (
    ACTION_TYPES,
    JOINT_STATE_TYPES,
    JointStates,
    RosVersion,
    goal_message,
    is_moving,
    result_of,
    robot_status_fault,
    ur_safety_fault,
)
from torc_lab.rosbridge.client import Rosbridge

StatusKind = Literal["industrial", "ur", "none"]
_STATUS_TYPES = {
    "industrial": {1: "industrial_msgs/RobotStatus", 2: "industrial_msgs/msg/RobotStatus"},
    "ur": {1: "ur_dashboard_msgs/SafetyMode", 2: "ur_dashboard_msgs/msg/SafetyMode"},
}
_FAULTS = {"industrial": robot_status_fault, "ur": ur_safety_fault}
_PROOF_S, _PROOF_CANCEL_S = 4.0, 0.5
"""Length of the motion on the spot that tests cancelling, and when it is cancelled."""
_CANCELLED_WITHIN_S = 1.0
_NOT_CANCELLED = {
    1: "Does the action exist under that name, with these joints, and is its controller running? Try `rostopic echo "
    "ACTION/status`.",
    2: "Start rosbridge with send_action_goals_in_new_thread:=true.",
}
_CONNECTS_S = 0.5
"""ROS 1 connects a new publisher to its readers this long after it was advertised; earlier messages are lost."""
_NOW = {"secs": 0, "nsecs": 0}


@dataclass(frozen=True)
class RosArmConfig:
    """The arm's topics and action.

    Attributes:
        url: address of rosbridge.
        ros: 1 or 2.
        action: the controller's, e.g. /scaled_joint_trajectory_controller/follow_joint_trajectory. For a Motoman of ROS
            1 use the group's: sda10f/sda10f_r2_controller/joint_trajectory_action is the right arm of an SDA10F, r1 its
            left one. The action for all groups sends groups that are not mentioned to zero, and checks nothing.
        joint_names: ROS's names of the robot description's joints, in its order; empty if the names are equal.
        joint_states, status_topic, status: topics of joint states and of status, and the status type: industrial
            (RobotStatus), ur (SafetyMode) or none; with none, only joint states and the controller's results show a
            stop.
        stop_service: called in addition to cancelling, e.g. /stop_motion of a Motoman; "" for none.
        start_tolerance_rad: a trajectory must start this close to the arm's position.
        most_points: longer trajectories are thinned out (MotoROS2: 200).
        timeout_s: how long to wait for the connection, and for an answer.
    """

    url: str
    ros: RosVersion
    action: str
    joint_names: tuple[str, ...] = ()
    joint_states: str = "/joint_states"
    status_topic: str = ""
    status: StatusKind = "none"
    stop_service: str = ""
    start_tolerance_rad: float = 1e-3
    most_points: int = 10_000
    timeout_s: float = 5.0

    def __post_init__(self) -> None:
        if self.ros not in (1, 2):
            raise InputError(f"ros is 1 or 2, not {self.ros}.")
        if self.status not in (*_FAULTS, "none") or (self.status != "none") != bool(self.status_topic):
            raise InputError("status is industrial or ur, with a status_topic; or none, without.")
        if self.most_points < 2 or self.start_tolerance_rad <= 0:
            raise InputError("RosArmConfig: at least 2 points, and a start tolerance above 0.")


class RosArm:
    """An arm behind rosbridge. It does not feel contacts.

    A lost connection is never made again. Before the first motion the driver only listens: it advertises no topic for
    goals and sends no goal.
    """

    feels_contact = False

    def __init__(self, config: RosArmConfig, joint_names: Sequence[str] = ()) -> None:
        """Connect and wait for the first messages. Raises LabError, MissingDependencyError.

        Args:
            config: the arm's topics and action.
            joint_names: the robot description's, used if `config` has none.
        """
        if not config.joint_names:
            config = replace(config, joint_names=tuple(joint_names))
        self.config, self.name = config, f"the arm of {config.action} at {config.url}"
        self.start_tolerance_rad = config.start_tolerance_rad
        self._goal = ""
        self._ended: str | None = None
        self._goals = itertools.count(1)
        self._began = int(time.time())
        self._advertised = self._proven = False
        self._joints = JointStates()
        self._lock: ControllerLock | None = None
        self._bridge = Rosbridge(config.url, config.timeout_s)
        try:
            self._listen()
        except LabError as error:
            self._bridge.close()
            raise LabError(f"{self.name} does not tell its state: {error}") from error

    def status(self) -> ArmStatus:
        """Return the latest status, stamped with the oldest of its parts. Raises LabError."""
        self._bridge.latest(self.config.joint_states)  # raises if the connection is lost
        qpos, stamp_s = self._joints.of(self.config.joint_names)
        stopped, moving = "", None
        if self.config.status_topic:
            told = self._bridge.latest(self.config.status_topic)
            # UR tells its safety mode only when it changes.
            stamp_s = min(stamp_s, told.stamp_s) if self.config.status == "industrial" else stamp_s
            stopped, moving = _FAULTS[self.config.status](told.message), is_moving(told.message)
        busy = bool(self._goal) and self.ended() is None
        return ArmStatus(stamp_s, qpos, busy if moving is None else moving, stopped)

    def other_joints(self) -> Mapping[str, float]:
        """Return the known positions of all joints in the joint states, radians, by name."""
        return self._joints.all()

    def prove_cancel(self) -> None:
        """Send a motion on the spot and cancel it, to prove that the arm can be stopped.

        Raises LabError if the motion ends too late, as rosbridge for ROS 2 lets it by default.
        """
        still = np.tile(self.status().qpos, (9, 1))
        self._send(Trajectory(np.linspace(0, _PROOF_S, 9), still, np.zeros_like(still)))
        time.sleep(_PROOF_CANCEL_S)
        if self.ended() is None:
            self._cancel()
            _wait_until(lambda: self.ended() is not None)
        ended = self.ended()
        if ended is None or (ended == "" and self.config.ros == 2):
            self._goal = ""
            raise LabError(
                f"{self.name} cannot be stopped: a goal that was cancelled went on. {_NOT_CANCELLED[self.config.ros]}"
            )
        _wait_until(lambda: not self.status().moving)  # what it says of itself comes a little later
        # A controller of ROS 1 may call a motion on the spot done at once: cancelling is a topic of its own there.
        self._proven = True

    def start(self, trajectory: Trajectory) -> None:
        """Send a trajectory; before the first one, prove that it could be cancelled. Raises LabError."""
        if not self._proven:
            self.prove_cancel()
        self._send(thinned(trajectory, self.config.most_points))

    def ended(self) -> str | None:
        """Return how the goal ended, from its first final status. Raises LabError if the connection is lost."""
        if not self._goal:
            return ""
        result = self._result()
        if self._ended is None:
            self._ended = result
        return self._ended

    def stop(self) -> None:
        """Cancel the goal and call the stop service. Raises LabError if the request cannot be sent."""
        self._cancel()
        if self.config.stop_service:
            threading.Thread(target=self._call_stop_service, daemon=True).start()

    def close(self) -> None:
        """End the connection; a goal goes on, so stop it first."""
        self._bridge.close()
        if self._lock is not None:
            self._lock.release()

    def _result(self) -> str | None:
        if self.config.ros == 2:
            if (found := self._bridge.goal_result(self._goal)) is None:
                return None
            status, values = found
            text = values.get("error_string", values.get("error"))
            ended = result_of(status, text, values.get("error_code"), 2)
            return "it ended without a final status" if ended is None else ended
        message = self._bridge.latest(f"{self.config.action}/result").message
        try:
            if message is None or message["status"]["goal_id"]["id"] != self._goal:
                return None
            status, text = message["status"]["status"], message["status"].get("text")
            return result_of(status, text, message["result"].get("error_code"), 1)
        except (KeyError, TypeError, AttributeError):
            return "its result cannot be read"

    def _listen(self) -> None:
        """Subscribe, and wait for each topic's first message. Raises LabError that lists the published topics."""
        config, ros = self.config, self.config.ros
        self._bridge.subscribe(config.joint_states, JOINT_STATE_TYPES[ros], self._joints.take)
        kinds = {config.joint_states: JOINT_STATE_TYPES[ros]}
        if config.status_topic:
            kinds[config.status_topic] = _STATUS_TYPES[config.status][ros]
            self._bridge.subscribe(config.status_topic, kinds[config.status_topic])
        for topic, kind in kinds.items():
            try:
                self._bridge.receive(topic)
            except LabError as error:
                raise LabError(f"{error}{self._bridge.published([kind])}") from error
        # Of several publishers the slowest may have our joints.
        _wait_until(lambda: self._joints.knows(config.joint_names), config.timeout_s)
        self.status()

    def _take_arm(self) -> None:
        """Lock the arm against other torcs and advertise the goals' topics, before the first goal.

        Raises LabError.
        """
        config = self.config
        if self._advertised:
            return
        self._lock = self._lock or ControllerLock(f"{config.url}/{config.action}")
        if config.ros == 1:
            self._bridge.subscribe(f"{config.action}/result", ACTION_TYPES[1] + "ActionResult")
            self._bridge.advertise(f"{config.action}/goal", ACTION_TYPES[1] + "ActionGoal")
            self._bridge.advertise(f"{config.action}/cancel", "actionlib_msgs/GoalID")
            time.sleep(_CONNECTS_S)
        self._advertised = True

    def _send(self, trajectory: Trajectory) -> None:
        self._take_arm()
        config, self._ended = self.config, None
        goal = goal_message(trajectory, config.joint_names, config.ros)
        if config.ros == 2:
            self._goal = self._bridge.send_goal(config.action, ACTION_TYPES[2], goal)
            return
        self._goal = f"torc-{self._began}-{next(self._goals)}"
        message = {
            "header": {"stamp": _NOW, "frame_id": ""},
            "goal_id": {"stamp": _NOW, "id": self._goal},
            "goal": goal,
        }
        self._bridge.publish(f"{config.action}/goal", message)

    def _cancel(self) -> None:
        if self._goal and self.config.ros == 2:
            self._bridge.cancel_goal(self.config.action, self._goal)
        elif self._goal:
            self._bridge.publish(f"{self.config.action}/cancel", {"stamp": _NOW, "id": self._goal})

    def _call_stop_service(self) -> None:
        with suppress(LabError):
            self._bridge.call(self.config.stop_service)


def _wait_until(true: Callable[[], bool], seconds: float | None = None) -> None:
    deadline = time.monotonic() + (_CANCELLED_WITHIN_S if seconds is None else seconds)
    while not true() and time.monotonic() < deadline:
        time.sleep(0.01)
