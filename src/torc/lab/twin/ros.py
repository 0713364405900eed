"""A trajectory controller of ROS 1 or ROS 2 that is none, behind rosbridge on the loopback interface.

Its arm is anybody's (`torc.lab.twin.behind`). Faults come on command.
"""

import json
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Self

import numpy as np

from torc.errors import MissingDependencyError, extra_remedy
from torc.lab.ros.messages import SUCCEEDED, RosVersion
from torc.lab.twin.behind import ArmBehind

_PERIOD_S = 0.02
READY = {"e_stopped": 0, "drives_powered": 1, "motion_possible": 1, "in_error": 0, "mode": 2}
_CANCELLED = {1: 2, 2: 5}
_ABORTED = {1: 4, 2: 6}


class RosTwin:
    """A server, in a `with`, with one controller.

    Attributes:
        state: of its robot_status; change it to press the e-stop, say.
        silent: it tells nothing any more.
        cancels: whether a goal ends when it is cancelled. rosbridge for ROS 2 takes cancelling in only once the goal
            has ended, unless it is told otherwise.
        heard: all that clients sent, but for subscriptions.
    """

    def __init__(
        self,
        arm: ArmBehind,
        joint_names: Sequence[str],
        ros: RosVersion = 2,
        action: str = "/arm/follow_joint_trajectory",
        port: int = 0,
    ) -> None:
        """Raises MissingDependencyError."""
        try:
            from websockets.sync.server import serve
        except ImportError as error:
            raise MissingDependencyError("websockets, for rosbridge,", extra_remedy("ros")) from error
        self.arm, self.joint_names, self.ros, self.action = arm, list(joint_names), ros, action
        self.state, self.silent, self.cancels = dict(READY), False, True
        self.heard: list[dict[str, Any]] = []
        self._lock = threading.RLock()
        self._goal: tuple[Any, str, list[float], np.ndarray, float] | None = None
        """Connection, id, times, path, and when it began."""
        self._connections: list[Any] = []
        self._running = True
        quick: dict[str, Any] = {
            "compression": None,
            "max_size": None,
            "ping_interval": None,
            "close_timeout": 0.5,
        }
        self._server = serve(self._serve, "127.0.0.1", port, **quick)
        self._threads = [
            threading.Thread(target=run, daemon=True) for run in (self._server.serve_forever, self._move)
        ]

    @property
    def url(self) -> str:
        """For `Rosbridge`."""
        return f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"

    @property
    def moving(self) -> bool:
        """Whether a goal goes on."""
        return self._goal is not None

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self.cut()
        self._server.shutdown()
        for thread in self._threads:
            thread.join()

    def cut(self) -> None:
        """Ends all connections without a farewell."""
        for connection in self._connections:
            with suppress(OSError):
                connection.socket.shutdown(2)
        self._connections.clear()

    def halt(self, **changed: int) -> None:
        """Stops the arm where it is, with another state, e.g. e_stopped=1; no motion is possible then."""
        with self._lock:
            self.state |= {"motion_possible": 0, **changed}
            self._end(_ABORTED[self.ros], "the robot was stopped")

    def _serve(self, connection: Any) -> None:
        self._connections.append(connection)
        with suppress(Exception):  # the connection was cut, here or there
            for text in connection:
                request = json.loads(text)
                if request["op"] == "subscribe":
                    threading.Thread(
                        target=self._publish, args=(connection, request["topic"]), daemon=True
                    ).start()
                else:
                    self.heard.append(request)
                    self._take(connection, request)

    def _publish(self, connection: Any, topic: str) -> None:
        """A topic's messages as long as the connection lasts."""
        with suppress(Exception):
            while self._running:
                message = None if self.silent else self._message(topic)
                if message is not None:
                    self._say(connection, {"op": "publish", "topic": topic, "msg": message})
                time.sleep(_PERIOD_S)

    def _message(self, topic: str) -> dict[str, Any] | None:
        if topic.endswith("joint_states"):
            names, qpos = self.joint_names, self.arm.qpos
            # Other joints are among them, in an order of their own.
            return {"name": ["finger", *reversed(names)], "position": [0.0, *map(float, qpos[::-1])]}
        if topic.endswith("robot_status"):
            told = {**self.state, "in_motion": int(self.moving)}
            return {**{k: {"val": v} for k, v in told.items()}, "error_code": 0}
        return None

    def _take(self, connection: Any, request: dict[str, Any]) -> None:
        op, topic = request["op"], request.get("topic", "")
        if op == "send_action_goal":
            self._begin(connection, request["id"], request["args"])
        elif op == "publish" and topic == f"{self.action}/goal":
            self._begin(connection, request["msg"]["goal_id"]["id"], request["msg"]["goal"])
        elif op == "cancel_action_goal" or (op == "publish" and topic == f"{self.action}/cancel"):
            goal = request["id"] if op == "cancel_action_goal" else request["msg"]["id"]
            with self._lock:
                if self.cancels and self._goal is not None and self._goal[1] == goal:
                    self._end(_CANCELLED[self.ros], "")

    def _begin(self, connection: Any, goal: str, args: dict[str, Any]) -> None:
        sign = ("secs", "nsecs") if self.ros == 1 else ("sec", "nanosec")
        points, names = args["trajectory"]["points"], args["trajectory"]["joint_names"]
        order = [names.index(name) for name in self.joint_names]
        times = [p["time_from_start"][sign[0]] + 1e-9 * p["time_from_start"][sign[1]] for p in points]
        path = np.array([[p["positions"][k] for k in order] for p in points])
        with self._lock:
            if self._goal is not None:
                self._end(_CANCELLED[self.ros], "another goal came")
            self._goal = connection, goal, times, path, time.monotonic()
            if not self.state["motion_possible"]:
                self._end(_ABORTED[self.ros], "no motion is possible")

    def _end(self, status: int, text: str) -> None:
        """Ends the goal and tells its client. As in ROS 1, the result of a cancelled goal carries error code 0."""
        if self._goal is None:
            return
        connection, goal, *_ = self._goal
        self._goal = None
        code = -4 if status == _ABORTED[self.ros] else 0
        if self.ros == 2:
            values = {"error_code": code, "error_string": text}
            told = {
                "op": "action_result",
                "action": self.action,
                "id": goal,
                "status": status,
                "values": values,
            }
            message = {**told, "result": True}
        else:
            told = {
                "status": {"goal_id": {"id": goal}, "status": status, "text": text},
                "result": {"error_code": code},
            }
            message = {"op": "publish", "topic": f"{self.action}/result", "msg": told}
        with suppress(Exception):
            self._say(connection, message)

    def _say(self, connection: Any, message: dict[str, Any]) -> None:
        connection.send(json.dumps(message))

    def _move(self) -> None:
        """Leads the arm along its goal."""
        while self._running:
            with self._lock:
                if self._goal is not None:
                    _, _, times, path, began = self._goal
                    elapsed = time.monotonic() - began
                    self.arm.goal(np.array([np.interp(elapsed, times, q) for q in path.T]))
                    if elapsed >= times[-1]:
                        self._end(SUCCEEDED[self.ros], "")
            time.sleep(0.004)
