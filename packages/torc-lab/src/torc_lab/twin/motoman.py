"""A simulated Motoman controller that answers simple_message on the loopback interface as MotoROS does.

It moves any `ArmBehind` of `torc_lab.twin.base`. Faults are triggered on command.
"""

import socket
import threading
import time
from contextlib import suppress
from dataclasses import replace

import numpy as np

from torc_lab.protocols import LabError
from torc_lab.simple_message.messages import (
    MAX_LENGTH,
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
)
from torc_lab.twin.base import HALFWAY_RAD, ArmBehind, TcpTwin

READY = RobotStatus(1, 0, 0, 0, 0, 2, 1)
_STATE_PERIOD_S = 0.025
_START_RAD = 1e-4
_QUEUE_S = 0.8
"""How far ahead the controller accepts motion (200 increments of 4 ms); beyond that it answers busy."""


class MotomanTwin(TcpTwin):
    """Serves one arm, as one of the controller's groups, during a `with`.

    The arm moves only while a motion connection is open. When that ends, the controller keeps its queue and plays the
    rest as soon as a client connects again. A second client replaces the first, but is rejected while there is motion
    in the queue. (motoman_driver 1.9.12, MotionServer.c)

    Attributes:
        state: the reported status except in_motion; change it to press the e-stop, for example.
        torso: position of group 2, which carries the arm, radians.
        silent: it publishes no state any more.
        heard: every message received on motion connections.
        clients: how many motion connections were accepted so far.
    """

    def __init__(
        self, arm: ArmBehind, max_speed: np.ndarray, group: int = 1, order: ByteOrder = "big"
    ) -> None:
        self.arm, self.max_speed, self.group, self.order = arm, max_speed, group, order
        self.state, self.silent = replace(READY, motion_possible=0, drives_powered=0), False
        self.heard: list[Frame] = []
        self.torso, self.clients = 0.0, 0
        self._client: socket.socket | None = None
        self._paused_at: float | None = time.monotonic()
        self._points: list[TrajectoryPoint] = []
        self._last: TrajectoryPoint | None = None
        self._began = 0.0
        self._lock = threading.RLock()
        super().__init__("127.0.0.1", [(0, self._serve_motion), (0, self._serve_state)], self._move)

    def halt(self, **changed: int) -> None:
        """Stop the arm where it is and change the state, e.g. e_stopped=1; no motion is possible afterwards."""
        with self._lock:
            self._points, self._last = [], None
            self.state = replace(self.state, **{"motion_possible": 0, **changed})

    def recover(self) -> None:
        """End all faults; connections that were cut stay so."""
        self.state, self.silent = READY, False

    def pretend_done(self) -> bool:
        """Stop the arm where it is and report an empty queue; return False if the arm is not halfway."""
        with self._lock:
            ahead = self._points[-1].qpos[: len(self.arm.qpos)] if self._points else self.arm.qpos
            if np.abs(ahead - self.arm.qpos).max() < HALFWAY_RAD:
                return False
            self._points, self._last = [], None
        return True

    def _serve_state(self, connection: socket.socket) -> None:
        while self._running:
            if not self.silent:
                status = replace(self.state, in_motion=int(bool(self._points) and self._paused_at is None))
                groups = {1 - self.group: np.zeros(7), 2: [self.torso]}
                groups[self.group] = self.arm.qpos
                feedback = [Feedback(k, np.array(q)).pack(self.order) for k, q in sorted(groups.items())]
                messages = [(Kind.JOINT_FEEDBACK, body) for body in feedback]
                for kind, body in (*messages, (Kind.ROBOT_STATUS, status.pack(self.order))):
                    connection.sendall(Frame(kind, Comm.TOPIC, body).pack(self.order))
            time.sleep(_STATE_PERIOD_S)

    def _serve_motion(self, connection: socket.socket) -> None:
        if not self._admits(connection):
            return
        try:
            self._converse(connection)
        finally:
            with self._lock:
                if self._client is connection:
                    self._client, self._paused_at = None, time.monotonic()

    def _admits(self, connection: socket.socket) -> bool:
        """Return whether to accept a client; if so, the queue continues under it."""
        with self._lock:
            if self._client is not None and self._points:
                connection.close()
                return False
            if self._client is not None:
                with suppress(OSError):
                    self._client.shutdown(socket.SHUT_RDWR)
            if self._paused_at is not None:
                self._began += time.monotonic() - self._paused_at
            self._client, self._paused_at = connection, None
            self.clients += 1
            return True

    def _converse(self, connection: socket.socket) -> None:
        with suppress(LabError), connection.makefile("rb") as stream:
            while length := stream.read(4):
                size = int.from_bytes(length, self.order)
                if size > MAX_LENGTH:
                    return
                frame = Frame.unpack(stream.read(size), self.order)
                self.heard.append(frame)
                reply = self._answer(frame)
                body = reply.pack(self.order)
                connection.sendall(Frame(Kind.MOTION_REPLY, Comm.REPLY, body, reply=1).pack(self.order))

    def _answer(self, frame: Frame) -> MotionReply:
        with self._lock:
            if frame.kind == Kind.JOINT_TRAJ_PT_FULL:
                point = TrajectoryPoint.unpack(frame.body, self.order)
                result, subcode = self._take(point)
                return MotionReply(point.group, point.sequence, frame.kind, result, subcode)
            group, sequence, command = np.frombuffer(
                frame.body, dtype=">i4" if self.order == "big" else "<i4", count=3
            ).tolist()
            result, subcode = self._obey(command)
            return MotionReply(group, sequence, command, result, subcode)

    def _take(self, point: TrajectoryPoint) -> tuple[int, int]:
        if not self.state.motion_possible:
            return Result.NOT_READY, self._not_ready()
        if point.group != self.group:
            return Result.INVALID, 3004
        dof = len(self.arm.qpos)
        if (np.abs(point.qvel[:dof]) > self.max_speed).any():
            return Result.INVALID, 3013
        if point.sequence == 0:
            if np.abs(point.qpos[:dof] - self.arm.qpos).max() > _START_RAD:
                return Result.INVALID, 3011
            self._points, self._began = [point], time.monotonic()
            return Result.SUCCESS, 0
        if not self._points and self._last is not None and point.sequence == self._last.sequence + 1:
            # The queue ran empty, and the arm waited.
            self._points, self._began = [self._last], time.monotonic() - self._last.time_s
        if not self._points:
            return Result.INVALID, 3005
        if point.time_s - (time.monotonic() - self._began) > _QUEUE_S:
            return Result.BUSY, 0
        self._points.append(point)
        return Result.SUCCESS, 0

    def _obey(self, command: int) -> tuple[int, int]:
        match command:
            case Command.START_TRAJ_MODE:
                if self.state.e_stopped or self.state.in_error or self.state.mode != READY.mode:
                    return Result.NOT_READY, self._not_ready()
                self.state = replace(self.state, motion_possible=1, drives_powered=1)
            case Command.STOP_TRAJ_MODE:
                self.halt()
            case Command.STOP_MOTION:
                self._points, self._last = [], None
            case Command.CHECK_QUEUE_COUNT:
                return Result.SUCCESS, len(self._points)
            case Command.CHECK_MOTION_READY:
                ready = bool(self.state.motion_possible) and not self.state.stopped
                return (Result.SUCCESS, 0) if ready else (Result.FAILURE, self._not_ready())
            case _:
                return Result.INVALID, 3006
        return Result.SUCCESS, 0

    def _not_ready(self) -> int:
        state = self.state
        reasons = {
            5003: state.e_stopped,
            5001: state.in_error,
            5004: state.mode != 2,
            5006: not state.drives_powered,
        }
        return next((code for code, true in reasons.items() if true), 5008)

    def _move(self) -> None:
        """Move the arm along the queued points."""
        with self._lock:
            if not self._points or self._paused_at is not None:
                return
            elapsed, dof = time.monotonic() - self._began, len(self.arm.qpos)
            times, path = [p.time_s for p in self._points], np.array([p.qpos[:dof] for p in self._points])
            self.arm.goal(np.array([np.interp(elapsed, times, q) for q in path.T]))
            if elapsed > times[-1] + 2 * _QUEUE_S or (len(times) > 1 and elapsed > times[-1] + 0.05):
                self._last, self._points = self._points[-1], []
