"""A simulated trajectory controller and camera of ROS 1 or 2, behind rosbridge on the loopback interface.

It moves any `ArmBehind` of `torc_lab.twin.base`. Faults are triggered on command.
"""

import base64
import json
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Self

import numpy as np
from websockets.sync.server import serve

from torc import Observation
from torc.records import as_capture
from torc.robots.protocols import Camera
from torc_lab.ros.messages import SUCCEEDED, RosVersion, duration
from torc_lab.twin.base import HALFWAY_RAD, PERIOD_S, ArmBehind
from torc_lab.twin.franka import FrankaHandTwin

_TELLS_S, _PICTURE_PERIOD_S = 0.02, 0.2
IMAGE_TOPICS = {
    "color": "/camera/color/image_raw",
    "depth": "/camera/aligned_depth_to_color/image_raw",
    "info": "/camera/color/camera_info",
}
"""Topic names of realsense-ros."""
READY = {"e_stopped": 0, "drives_powered": 1, "motion_possible": 1, "in_error": 0, "mode": 2}
_CANCELLED = {1: 2, 2: 5}
_ABORTED = {1: 4, 2: 6}


class RosTwin:
    """Serves one controller during a `with`.

    Attributes:
        state: fields of its robot_status; change them to press the e-stop, for example.
        silent: it publishes nothing any more.
        others: positions of joints that are not the arm's, radians. Each is published on the topic of joint states by
            a node of its own, as a Motoman driver does with its groups, or a gripper's driver.
        frozen: its camera repeats one picture.
        cancels: whether a goal ends when it is cancelled. rosbridge for ROS 2, as configured by default, reads a
            cancel request only once the goal has ended.
        heard: all client requests except subscriptions.
    """

    def __init__(
        self,
        arm: ArmBehind,
        joint_names: Sequence[str],
        ros: RosVersion = 2,
        action: str = "/arm/follow_joint_trajectory",
        camera: Camera | None = None,
        hand: FrankaHandTwin | None = None,
    ) -> None:
        """Set up the server; without a camera it publishes no pictures, without a hand it has no gripper."""
        self.arm, self.joint_names, self.ros, self.action = arm, list(joint_names), ros, action
        self.state, self.silent, self.cancels = dict(READY), False, True
        self.others: dict[str, float] = {"finger": 0.0}
        self.heard: list[dict[str, Any]] = []
        self._camera, self._picture_lock, self._hand = camera, threading.Lock(), hand
        self._pictures: tuple[float, dict[str, dict[str, Any]]] = (-1.0, {})
        self.frozen = False
        self._lock = threading.RLock()
        self._goal: tuple[Any, str, list[float], np.ndarray, float] | None = None
        """Connection, id, times, path, and when it began."""
        self._connections: list[Any] = []
        self._wishes: set[tuple[Any, str | None, str]] = set()
        self._running = True
        quick: dict[str, Any] = {"compression": None, "max_size": None, "ping_interval": None}
        self._server = serve(self._serve, "127.0.0.1", 0, close_timeout=0.5, **quick)
        self._threads = [
            threading.Thread(target=run, daemon=True) for run in (self._server.serve_forever, self._move)
        ]

    @property
    def url(self) -> str:
        """Return the address for `Rosbridge`."""
        return f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"

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
        """End all connections abruptly, without a closing message."""
        for connection in self._connections:
            with suppress(OSError):
                connection.socket.shutdown(2)
        self._connections.clear()

    def halt(self, **changed: int) -> None:
        """Stop the arm where it is and change the state, e.g. e_stopped=1; no motion is possible afterwards."""
        with self._lock:
            self.state |= {"motion_possible": 0, **changed}
            self._end(_ABORTED[self.ros], "the robot was stopped")

    def recover(self) -> None:
        """End all faults; connections that were cut stay so."""
        self.state, self.silent, self.frozen = dict(READY), False, False

    def pretend_done(self) -> bool:
        """Stop the arm where it is and report success; return False if the arm is not halfway."""
        with self._lock:
            if self._goal is None or np.abs(self._goal[3][-1] - self.arm.qpos).max() < HALFWAY_RAD:
                return False
            self._end(SUCCEEDED[self.ros], "")
        return True

    def _serve(self, connection: Any) -> None:
        self._connections.append(connection)
        with suppress(Exception):  # the connection was cut, here or there
            for text in connection:
                request = json.loads(text)
                if request["op"] == "subscribe":
                    wish = connection, request.get("id"), request["topic"]
                    self._wishes.add(wish)
                    threading.Thread(target=self._publish, args=wish, daemon=True).start()
                elif request["op"] == "unsubscribe":
                    self._wishes.discard((connection, request.get("id"), request["topic"]))
                else:
                    self.heard.append(request)
                    self._take(connection, request)

    def _publish(self, connection: Any, wish: str | None, topic: str) -> None:
        """Publish a topic's messages until the client unsubscribes or the connection ends."""
        with suppress(Exception):
            while self._running and (connection, wish, topic) in self._wishes:
                for message in [] if self.silent else self._messages(topic):
                    self._say(connection, {"op": "publish", "topic": topic, "msg": message})
                time.sleep(_PICTURE_PERIOD_S if topic in IMAGE_TOPICS.values() else _TELLS_S)

    def _messages(self, topic: str) -> list[dict[str, Any]]:
        """Return the next messages on a topic, one from each of its publishers."""
        if self._hand is not None and topic == f"{self._hand.name}/joint_states":
            return [self._hand.joint_states()]
        if topic.endswith("joint_states"):
            # In an order of its own.
            own = dict(zip(reversed(self.joint_names), self.arm.qpos[::-1], strict=True))
            return [self._joint_states(own), *(self._joint_states({k: q}) for k, q in self.others.items())]
        if topic.endswith("robot_status"):
            state = {**self.state, "in_motion": int(self._goal is not None)}
            return [{**{k: {"val": v} for k, v in state.items()}, "error_code": 0}]
        if topic.endswith("safety_mode"):
            return [{"mode": self._safety_mode()}]
        for name, picture_topic in IMAGE_TOPICS.items():
            if topic == picture_topic and self._camera is not None:
                return [self._picture(self._camera)[name]]
        return []

    def _joint_states(self, positions: Mapping[str, float]) -> dict[str, Any]:
        header = {"stamp": duration(time.time(), self.ros), "frame_id": ""}
        return {"header": header, "name": list(positions), "position": [float(q) for q in positions.values()]}

    def _safety_mode(self) -> int:
        """Return a UR's safety mode: normal, protective stop, safeguard stop or robot emergency stop."""
        faults = {7: self.state["e_stopped"], 3: self.state["in_error"], 5: self.state["mode"] != 2}
        return next((mode for mode, true in faults.items() if true), 1)

    def _picture(self, camera: Camera) -> dict[str, dict[str, Any]]:
        """Return the messages of one snapshot, by name; take a new one if the last is old."""
        with self._picture_lock:
            taken_s, found = self._pictures
            if not found or (not self.frozen and time.monotonic() - taken_s > _PICTURE_PERIOD_S):
                found = image_messages(as_capture(camera.capture()).observation, self.ros)
                self._pictures = time.monotonic(), found
            return found

    def _take(self, connection: Any, request: dict[str, Any]) -> None:
        op, topic = request["op"], request.get("topic", "")
        if op == "send_action_goal" and request["action"] != self.action:
            threading.Thread(target=self._act, args=(connection, request), daemon=True).start()
        elif op == "send_action_goal":
            self._begin(connection, request["id"], request["args"])
        elif op == "publish" and topic == f"{self.action}/goal":
            self._begin(connection, request["msg"]["goal_id"]["id"], request["msg"]["goal"])
        elif op == "cancel_action_goal" or (op == "publish" and topic == f"{self.action}/cancel"):
            goal = request["id"] if op == "cancel_action_goal" else request["msg"]["id"]
            with self._lock:
                if self.cancels and self._goal is not None and self._goal[1] == goal:
                    self._end(_CANCELLED[self.ros], "")

    def _act(self, connection: Any, request: dict[str, Any]) -> None:
        """Let the hand carry out an action, and report the result."""
        action, hand = request["action"], self._hand
        if hand is None or not action.startswith(f"{hand.name}/"):
            self._tell_result(connection, action, request["id"], 0, "no such action", False)
        else:
            status, values = hand.act(action.removeprefix(f"{hand.name}/"), request["args"])
            self._tell_result(connection, action, request["id"], status, values)

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
        """End the goal and notify its client. As in ROS 1, the result of a cancelled goal carries error code 0."""
        if self._goal is None:
            return
        connection, goal, *_ = self._goal
        self._goal = None
        code = -4 if status == _ABORTED[self.ros] else 0
        if self.ros == 2:
            values = {"error_code": code, "error_string": text}
            self._tell_result(connection, self.action, goal, status, values)
        else:
            told = {"goal_id": {"id": goal}, "status": status, "text": text}
            result = {"status": told, "result": {"error_code": code}}
            with suppress(Exception):
                self._say(connection, {"op": "publish", "topic": f"{self.action}/result", "msg": result})

    def _tell_result(
        self, connection: Any, action: str, goal: str, status: int, values: Any, known: bool = True
    ) -> None:
        told = {"action": action, "id": goal, "status": status, "values": values, "result": known}
        with suppress(Exception):
            self._say(connection, {"op": "action_result", **told})

    def _say(self, connection: Any, message: dict[str, Any]) -> None:
        connection.send(json.dumps(message))

    def _move(self) -> None:
        """Move the arm along its goal."""
        while self._running:
            with self._lock:
                if self._goal is not None:
                    _, _, times, path, began = self._goal
                    elapsed = time.monotonic() - began
                    self.arm.goal(np.array([np.interp(elapsed, times, q) for q in path.T]))
                    if elapsed >= times[-1]:
                        self._end(SUCCEEDED[self.ros], "")
            time.sleep(PERIOD_S)


def image_messages(view: Observation, ros: RosVersion) -> dict[str, dict[str, Any]]:
    """Return a snapshot as Image messages "color" and "depth" (millimetres), and its lens as CameraInfo "info"."""
    height, width = view.depth_m.shape
    stamp = duration(view.stamp_s, ros)
    common = {"header": {"stamp": stamp, "frame_id": "camera_color_optical_frame"}}
    common |= {"height": height, "width": width}

    def image(encoding: str, pixels: np.ndarray) -> dict[str, Any]:
        data = base64.b64encode(np.ascontiguousarray(pixels).tobytes()).decode("ascii")
        step = pixels[0].nbytes
        return {**common, "encoding": encoding, "is_bigendian": 0, "step": step, "data": data}

    P = np.hstack([view.K, np.zeros((3, 1))])
    names = {"K": view.K, "D": np.zeros(5), "R": np.eye(3), "P": P}
    lens = {name if ros == 1 else name.lower(): value.ravel().tolist() for name, value in names.items()}
    roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0}
    info = {**common, "distortion_model": "plumb_bob", **lens, "binning_x": 0, "binning_y": 0, "roi": roi}
    depth = np.clip(np.rint(view.depth_m * 1e3), 0, 65535).astype("<u2")
    return {"color": image("rgb8", view.rgb), "depth": image("16UC1", depth), "info": info}
