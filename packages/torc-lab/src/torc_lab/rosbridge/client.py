"""A small client of rosbridge: topics, services and actions of ROS 1 or ROS 2, as JSON over a web socket.

It is made for robots: nothing waits in a queue. It keeps only the newest message of each topic. A message that cannot
be sent now raises at once, so that no old command reaches a robot when a connection comes back. A lost connection is
not made again: every call raises from then on. (Protocol: rosbridge_suite, ROSBRIDGE_PROTOCOL.md, version 2.)
"""

import itertools
import json
import threading
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Self

from torc import TorcError
from torc.errors import MissingDependencyError, extra_remedy
from torc_lab.link import Link
from torc_lab.protocols import LabError

_MAX_BYTES = 256 * 2**20
"""Largest message: a picture of 20 megapixels as base64 has 80 MB."""
_MOST_WAITING = 20
"""Messages of a topic that the server keeps for a reader that wants them all."""
_ALIVE_S = 5.0
"""A server that does not answer a ping within this time is gone."""
_MOST_BEGUN = 8
"""Most long messages of which only some fragments have come."""
_TOPICS_S, _MOST_LISTED = 1.0, 12
"""Time in which rosapi lists the topics, if it runs; most topics to name in a message."""
Take = Callable[[Any, float], None]


class RosbridgeError(LabError):
    """rosbridge cannot be reached, has gone away, refuses a request, or does not answer."""


@dataclass(frozen=True)
class Latest:
    """The newest message of a topic: how many had come by then, and when it came, by `time.monotonic`."""

    count: int
    message: Any
    stamp_s: float


_NOTHING = Latest(0, None, float("-inf"))


class Rosbridge(Link):
    """A connection. Close it, or use it in a `with`. Several threads may use it."""

    fault = RosbridgeError

    def __init__(self, url: str, timeout_s: float = 5.0) -> None:
        """Connect to a URL such as ws://robot:9090. Raises RosbridgeError, MissingDependencyError."""
        try:
            from websockets.exceptions import WebSocketException
            from websockets.sync.client import connect
        except ImportError as error:
            raise MissingDependencyError("websockets, for rosbridge,", extra_remedy("lab")) from error
        super().__init__(f"The connection to rosbridge at {url}")
        self.url, self._timeout_s = url, timeout_s
        self._open = ExitStack()
        try:
            # From version 17 on, websockets wants a `with`.
            self._socket = self._open.enter_context(
                connect(
                    url,
                    open_timeout=timeout_s,
                    close_timeout=1,
                    max_size=_MAX_BYTES,
                    compression=None,
                    ping_interval=_ALIVE_S,
                    ping_timeout=_ALIVE_S,
                    proxy=None,
                )
            )
        except (OSError, ValueError, WebSocketException) as error:
            raise RosbridgeError(
                f"rosbridge cannot be reached at {url}: {error or type(error).__name__}. Start it there (`ros2 launch "
                "rosbridge_server rosbridge_websocket_launch.xml`, or roslaunch), and check address and port."
            ) from error
        self._numbers = itertools.count(1)
        self._latest: dict[str, Latest] = {}
        self._takes: dict[str, Take] = {}
        self._answers: dict[str, Any] = {}
        """Answers by the id of their request; None until it is answered."""
        self._refusals: dict[str, str] = {}
        """The server's errors, by the id of the request that failed."""
        self._fragments: dict[Any, dict[int, str]] = {}
        threading.Thread(target=self._read, name="torc-rosbridge", daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the connection."""
        self._lose("it was closed")
        self._open.close()

    def subscribe(self, topic: str, kind: str = "", take: Take | None = None) -> str:
        """Subscribe to a topic; return the subscription's id.

        Args:
            topic: its name.
            kind: type of its messages, e.g. sensor_msgs/Image; without it the server looks the type up, and ignores a
                topic that nobody publishes.
            take: called with every message and its time of arrival, by `time.monotonic`, in the thread that reads. The
                server then drops messages for a slow reader only if many wait; without `take` it keeps only the newest.
        """
        wish = f"subscribe:{topic}:{next(self._numbers)}"
        typed = {"type": kind} if kind else {}
        if take is not None:
            self._takes[topic] = take
        length = 1 if take is None else _MOST_WAITING
        self._send({"op": "subscribe", "id": wish, "topic": topic, "queue_length": length, **typed})
        return wish

    def unsubscribe(self, topic: str, wish: str) -> None:
        """End a subscription by its id. Raises RosbridgeError if the connection is lost."""
        self._send({"op": "unsubscribe", "id": wish, "topic": topic})

    def latest(self, topic: str) -> Latest:
        """Return the newest message of a subscribed topic; never waits. Before the first, count is 0 and message None.

        Raises RosbridgeError once the connection is lost.
        """
        self._check()
        with self._news:
            return self._latest.get(topic, _NOTHING)

    def receive(
        self, topic: str, after: int = 0, timeout_s: float | None = None, wish: str = ""
    ) -> tuple[int, Any]:
        """Return how many messages have come, and the newest, as soon as more than `after` have.

        Raises RosbridgeError after the time-out, at once if the connection is lost, and if the server refused the
        subscription with the id `wish`.
        """
        with self._news:
            self._expect(
                lambda: self._latest.get(topic, _NOTHING).count > after,
                f"no message on {topic}",
                timeout_s,
                wish,
            )
            latest = self._latest[topic]
            return latest.count, latest.message

    def once(self, topic: str, kind: str = "", timeout_s: float | None = None) -> Any:
        """Return one message of a topic, sent after this call, or latched. Raises as `receive`."""
        seconds = self._timeout_s if timeout_s is None else timeout_s
        with Newest(self, topic, time.monotonic() + seconds, kind) as newest:
            return newest.message()

    def advertise(self, topic: str, kind: str) -> None:
        """Announce that messages of this type will be published. Raises RosbridgeError if the connection is lost."""
        wish = f"advertise:{topic}:{next(self._numbers)}"
        self._send({"op": "advertise", "id": wish, "topic": topic, "type": kind})

    def publish(self, topic: str, message: Mapping[str, Any]) -> None:
        """Send a message now. Raises RosbridgeError if the connection is lost."""
        self._send({"op": "publish", "topic": topic, "msg": dict(message)})

    def call(
        self, service: str, arguments: Mapping[str, Any] | None = None, timeout_s: float | None = None
    ) -> dict[str, Any]:
        """Call a service and return its answer. Raises RosbridgeError if it fails or does not answer."""
        wish = self._ask({"op": "call_service", "service": service, "args": dict(arguments or {})})
        with self._news:
            try:
                silence = f"no answer of service {service}"
                self._expect(lambda: self._answers[wish] is not None, silence, timeout_s, wish)
            finally:
                answer = self._answers.pop(wish)
        if not answer.get("result", True):
            raise RosbridgeError(f"rosbridge at {self.url}: service {service} failed: {answer.get('values')}")
        values = answer.get("values", {})
        return values if isinstance(values, dict) else {"value": values}

    def published(self, kinds: Collection[str]) -> str:
        """Return a sentence for messages that names the topics of these types, e.g. sensor_msgs/Image.

        Returns "" if the topics cannot be listed; that needs the node rosapi beside rosbridge.
        """
        try:
            answer = self.call("/rosapi/topics", timeout_s=_TOPICS_S)
            there = sorted(zip(answer["topics"], answer["types"], strict=True))
        except (RosbridgeError, LookupError, TypeError, ValueError):
            return ""
        found = [f"{name} ({kind})" for name, kind in there if kind in kinds]
        if not found:
            return f" Nothing of the type {' or '.join(kinds)} is published."
        return f" Published are: {', '.join(found[:_MOST_LISTED])}."

    def send_goal(self, action: str, kind: str, goal: Mapping[str, Any]) -> str:
        """Send a goal to an action of ROS 2 now, and return its id. Raises RosbridgeError."""
        return self._ask(
            {"op": "send_action_goal", "action": action, "action_type": kind, "args": dict(goal)}
        )

    def cancel_goal(self, action: str, goal: str) -> None:
        """Request that a goal of ROS 2 be cancelled. Raises RosbridgeError."""
        self._send({"op": "cancel_action_goal", "id": goal, "action": action})

    def goal_result(self, goal: str) -> tuple[Any, dict[str, Any]] | None:
        """Return the final status and the values of a goal of ROS 2; None while it goes on.

        Raises RosbridgeError if the server refused it, or the connection is lost.
        """
        self._check()
        with self._news:
            if goal in self._refusals:
                raise RosbridgeError(f"rosbridge at {self.url} refuses: {self._refusals[goal]}")
            answer = self._answers.get(goal)
        if answer is None:
            return None
        values = answer.get("values")
        return answer.get("status"), values if isinstance(values, dict) else {"error": values}

    def _ask(self, request: Mapping[str, Any]) -> str:
        """Send a request that will be answered; return its id."""
        wish = f"{request['op']}:{next(self._numbers)}"
        with self._news:
            self._answers[wish] = None
        self._send({**request, "id": wish})
        return wish

    def _send(self, request: Mapping[str, Any]) -> None:
        from websockets.exceptions import WebSocketException

        self._check()
        try:
            self._socket.send(json.dumps(request))
        except (OSError, WebSocketException) as error:
            raise self._lose(error) from error

    def _expect(self, there: Callable[[], bool], silence: str, timeout_s: float | None, wish: str) -> None:
        """Wait, with the lock held, until `there` holds. Raises RosbridgeError.

        Most servers do not report a refusal, and only a time-out shows it.
        """
        seconds = self._timeout_s if timeout_s is None else timeout_s
        if self._await(lambda: there() or wish in self._refusals, seconds) and there():
            return
        self._check()
        if wish in self._refusals:
            raise RosbridgeError(f"rosbridge at {self.url} refuses: {self._refusals.pop(wish)}")
        raise RosbridgeError(
            f"rosbridge at {self.url}: {silence} within {seconds:g} s. Does anybody offer that, under that name?"
        )

    def _read(self) -> None:
        """Take in every message, until the connection ends."""
        try:
            for text in self._socket:
                self._take(text)
            self._lose("the server ended it")
        except Exception as error:  # whatever ends the reader, nobody may wait for it any more
            self._lose(error)

    def _take(self, text: str | bytes) -> None:
        try:
            message = json.loads(text)
            what, topic = message["op"], message.get("topic", "")
        except (ValueError, TypeError, LookupError, AttributeError) as error:
            raise TorcError(f"it sent what is no message of rosbridge: {text[:80]!r}") from error
        whole = ""
        with self._news:
            if what == "fragment":
                whole = self._joined(message)
            elif what == "publish":
                count = self._latest.get(topic, _NOTHING).count + 1
                latest = self._latest[topic] = Latest(count, message.get("msg"), time.monotonic())
                if topic in self._takes:
                    self._takes[topic](latest.message, latest.stamp_s)
            elif what in ("service_response", "action_result") and message.get("id") in self._answers:
                self._answers[message["id"]] = self._answers[message["id"]] or message  # the first counts
            elif what == "status" and message.get("level") == "error":
                self._refusals[str(message.get("id"))] = str(message.get("msg"))
            self._news.notify_all()
        if whole:
            self._take(whole)

    def _joined(self, fragment: Mapping[str, Any]) -> str:
        """Return the long message that this fragment completes, else "".

        Raises TorcError if the fragment is too long or has a wrong number.
        """
        number, total = int(fragment["num"]), int(fragment["total"])
        if total * len(fragment["data"]) > 2 * _MAX_BYTES or not 0 <= number < total:
            raise TorcError("it sent fragments that are too long, or have wrong numbers")
        while len(self._fragments) > _MOST_BEGUN:
            del self._fragments[next(iter(self._fragments))]
        parts = self._fragments.setdefault(fragment["id"], {})
        parts[number] = fragment["data"]
        if len(parts) < total:
            return ""
        del self._fragments[fragment["id"]]
        return "".join(parts[k] for k in range(total))


class Newest:
    """Messages of one topic, each newer than the one before, during a `with`."""

    def __init__(self, bridge: Rosbridge, topic: str, deadline_s: float, kind: str = "") -> None:
        """Subscribe. All messages must come before deadline_s, by `time.monotonic`."""
        self.topic = topic
        self._bridge, self._deadline_s = bridge, deadline_s
        self._seen = bridge.latest(topic).count
        self._wish = bridge.subscribe(topic, kind)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if not self._bridge.lost:
            self._bridge.unsubscribe(self.topic, self._wish)

    def message(self) -> Any:
        """Return the next new message, waiting for it. Raises RosbridgeError."""
        left_s = max(0.0, self._deadline_s - time.monotonic())
        self._seen, found = self._bridge.receive(self.topic, self._seen, left_s, self._wish)
        return found
