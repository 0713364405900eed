"""The `ArmDriver` of a Motoman controller with MotoROS, without ROS."""

import itertools
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from torc import InputError
from torc.records import Trajectory
from torc_lab.checks import thinned
from torc_lab.exclusive import ControllerLock
from torc_lab.link import Link
from torc_lab.protocols import ArmStatus, LabError
from torc_lab.simple_message.channel import Channel
from torc_lab.simple_message.messages import (
    JOINTS,
    MOTION_PORT,
    STATE_PORT,
    ByteOrder,
    Comm,
    Command,
    Feedback,
    Frame,
    Kind,
    MotionReply,
    Result,
    RobotStatus,
    TrajectoryPoint,
    feedback_of,
    motion_ctrl,
)

_BUSY_S, _POLL_S = 0.005, 0.05
_POINT_S = 0.04
"""Time between the points that are sent: each needs an exchange, and the controller bends a curve through them."""
_FIRST = 3
"""Wait for the controller's first state, in time-outs."""


@dataclass(frozen=True)
class MotomanConfig:
    """Address of the controller, and the arm's group.

    Attributes:
        host: its name or address.
        group: the arm's group on the controller, counted from 0. Two-armed robots count the left arm first: the right
            arm of an SDA10F is group 1.
        motion_port, state_port: of MotoROS.
        timeout_s: for one answer.
    """

    host: str
    group: int
    motion_port: int = MOTION_PORT
    state_port: int = STATE_PORT
    timeout_s: float = 1.0

    def __post_init__(self) -> None:
        if not 0 <= self.group <= 3 or not self.timeout_s > 0:
            raise InputError("MotomanConfig: group is 0 to 3, timeout_s above 0.")


class MotomanArm(Link):
    """One group of a controller, e.g. the right arm of an SDA10F.

    It does not feel contacts. The controller stops all groups at once, and checks that a trajectory starts within 30
    pulses of the arm's position.

    The first command opens the connection for motions, nothing earlier. If its client dies, a controller keeps up to .8
    s of motion and plays it as soon as the next one connects; so the first frame on a new connection is a stop.
    (Source: motoman_driver 1.9.12, MotionServer.c: a closed connection deletes the tasks, not the queue.)
    """

    feels_contact = False
    start_tolerance_rad = 1e-4

    def __init__(self, config: MotomanConfig, dof: int) -> None:
        """Connect and wait for the first state. dof: number of the arm's joints. Raises LabError, InputError."""
        if not 1 <= dof <= JOINTS:
            raise InputError(f"A group of a Motoman has at most {JOINTS} joints, not {dof}.")
        super().__init__(f"Motoman at {config.host}, group {config.group}")
        self.group, self.dof, self._config = config.group, dof, config
        self._qpos: np.ndarray | None = None
        self._others: dict[str, float] = {}
        self._robot: RobotStatus | None = None
        self._stamps = [0.0, 0.0]
        self._state = Channel(config.host, config.state_port, config.timeout_s)
        threading.Thread(target=self._read, name="torc-motoman-state", daemon=True).start()
        known = self._await(lambda: self._qpos is not None and self._robot, _FIRST * config.timeout_s)
        if self.lost or not known:
            self._state.close()
            self._check()
            raise LabError(f"{self.name} does not tell its state: is there such a group?")
        self._motion: Channel | None = None
        self._lock: ControllerLock | None = None
        self._opening = threading.RLock()
        self._sequence = itertools.count(1)
        self._ended: str | None = ""
        self._cancelled = threading.Event()

    def status(self) -> ArmStatus:
        """Return the latest status, stamped with the older of its parts. Raises LabError if the connection is lost."""
        with self._news:
            self._check()
            assert self._qpos is not None
            assert self._robot is not None
            moving = self._robot.in_motion != 0
            return ArmStatus(min(self._stamps), self._qpos.copy(), moving, self._robot.stopped)

    def other_joints(self) -> Mapping[str, float]:
        """Return the first joint of every other group, radians; a torso has only this one. Raises LabError."""
        with self._news:
            self._check()
            return dict(self._others)

    def enable(self) -> None:
        """Power the servos and let trajectories in (the controller's job INIT_ROS). **The brakes open.**

        Raises LabError with the controller's reason.
        """
        self._command(Command.START_TRAJ_MODE)

    def start(self, trajectory: Trajectory) -> None:
        """Send the first point, which the controller checks, and go on sending. Raises LabError if it refuses."""
        self._command(Command.CHECK_MOTION_READY)
        trajectory = thinned(trajectory, max(2, int(np.ceil(trajectory.duration_s / _POINT_S)) + 1))
        self._cancelled, self._ended = threading.Event(), None
        refused = self._send(trajectory, 0, self._cancelled)
        if refused:
            self._ended = refused
            raise LabError(f"{self.name} refuses the trajectory: {refused}.")
        threading.Thread(
            target=self._stream, args=(trajectory, self._cancelled), name="torc-motoman-motion", daemon=True
        ).start()

    def ended(self) -> str | None:
        """Return None until all points are sent and the controller's queue is empty. Raises LabError if it is lost."""
        self._check()
        return self._ended

    def stop(self) -> None:
        """Send no further points and clear the controller's queue; do nothing if this connection has moved nothing.

        Raises LabError if the controller cannot be reached.
        """
        self._cancelled.set()
        if self._ended is None:
            self._ended = "torc stopped it"
        if self._motion is not None:
            self._command(Command.STOP_MOTION)

    def close(self) -> None:
        """Stop, and end both connections."""
        with suppress(LabError):
            self.stop()  # the controller would keep its queue for whoever connects next
        self._lose("it was closed")
        self._state.close()
        if self._motion is not None:
            self._motion.close()
        if self._lock is not None:
            self._lock.release()

    def _opened(self) -> Channel:
        """Return the connection for motions; opening it stops all motion left in the controller's queue.

        Raises LabError, also if another torc moves this controller.
        """
        with self._opening:
            if self._motion is None:
                host, port = self._config.host, self._config.motion_port
                self._lock = self._lock or ControllerLock(f"{host}:{port}")
                # Commands have the byte order of the state connection.
                self._motion = Channel(host, port, self._config.timeout_s, self._state.order)
                try:
                    self._command(Command.STOP_MOTION)
                except LabError as error:
                    self._motion.close()
                    self._motion = None
                    raise LabError(
                        f"{self.name} could not be stopped before the first motion: {error} Does another client move "
                        "this controller? It takes one at a time."
                    ) from error
            return self._motion

    def _command(self, command: Command) -> int:
        """Send a command and return the reply's subcode. Raises LabError with the reason if it failed."""
        sequence = next(self._sequence)
        body = motion_ctrl(self.group, sequence, command, self._order)
        reply = self._asked(Frame(Kind.MOTION_CTRL, Comm.REQUEST, body))
        if (reply.command, reply.sequence) != (command, sequence):
            raise self._lose(f"it answered something else than command {command} of number {sequence}")
        if reply.result != Result.SUCCESS:
            raise LabError(f"{self.name} refuses {command.name}: {reply.reason}.")
        return reply.subcode

    @property
    def _order(self) -> ByteOrder:
        return self._state.order or "big"

    def _asked(self, frame: Frame) -> MotionReply:
        reply = self._opened().ask(frame)
        if reply.kind != Kind.MOTION_REPLY:
            raise self._lose(f"it answered with a message of type {reply.kind}")
        return MotionReply.unpack(reply.body, self._order)

    def _send(self, trajectory: Trajectory, k: int, cancelled: threading.Event) -> str:
        """Send one point, repeatedly while the controller is busy; return why it was refused, or ""."""
        t, q, v = trajectory.times_s[k], trajectory.qpos[k], trajectory.qvel[k]
        point = TrajectoryPoint(self.group, k, float(t), q, v)
        frame = Frame(Kind.JOINT_TRAJ_PT_FULL, Comm.REQUEST, point.pack(self._order))
        while not cancelled.is_set():
            reply = self._asked(frame)
            # MotoROS of old leaves the number out.
            if reply.command != Kind.JOINT_TRAJ_PT_FULL or reply.sequence not in (k, -1):
                raise self._lose(f"it answered something else than point {k}")
            if reply.result == Result.SUCCESS:
                return ""
            if reply.result != Result.BUSY:
                return f"point {k}: {reply.reason}"
            cancelled.wait(_BUSY_S)
        return "torc stopped it"

    def _stream(self, trajectory: Trajectory, cancelled: threading.Event) -> None:
        """Send the other points, and wait until the queue is empty."""
        how, k = "", 1
        try:
            while not how and k < len(trajectory.times_s):
                how, k = self._send(trajectory, k, cancelled), k + 1
            while not how and not cancelled.wait(_POLL_S):
                if self._command(Command.CHECK_QUEUE_COUNT) == 0:
                    break
        except LabError as error:
            how = str(error)
        if not cancelled.is_set():
            self._ended = how

    def _read(self) -> None:
        """Take in the controller's messages about its state."""
        try:
            while True:
                frame = self._state.receive()
                with self._news:
                    if frame.kind == Kind.ROBOT_STATUS:
                        self._robot = RobotStatus.unpack(frame.body, self._order)
                        self._stamps[0] = time.monotonic()
                    elif frame.kind in (Kind.JOINT_FEEDBACK, Kind.JOINT_FEEDBACK_EX):
                        for feedback in feedback_of(frame, self._order):
                            self._take(feedback)
                    self._news.notify_all()
        except Exception as error:  # whatever ends the reader, nobody may go on without it
            self._lose(error)

    def _take(self, feedback: Feedback) -> None:
        if feedback.group == self.group:
            self._qpos, self._stamps[1] = feedback.qpos[: self.dof], time.monotonic()
        else:
            self._others[f"group {feedback.group}"] = float(feedback.qpos[0])
