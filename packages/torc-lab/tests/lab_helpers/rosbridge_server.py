"""A fake rosbridge on the loopback interface: it speaks the protocol and does what a test tells it.

Written after ROSBRIDGE_PROTOCOL.md of rosbridge_suite. websockets is imported when a server is made, so that tests can
skip where it is missing.
"""

import base64
import json
import socket
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from enum import Enum
from typing import Any

import numpy as np


class Broken(Enum):
    """In place of a message: a connection that is cut, text that is no JSON, an error of the server, a message in
    fragments (the next one).
    """

    CUT = "cut"
    NONSENSE = "nonsense"
    REFUSED = "refused"
    IN_PARTS = "in parts"


class FakeRosbridge:
    """A server, in a `with`. Of a topic it sends all messages at once when it is subscribed to; of one that it does not
    know, none. A service answers what `services` holds: values, or a text, with which it fails.

    Attributes:
        asked: all that clients sent.
    """

    def __init__(
        self, topics: Mapping[str, Sequence[Any]] | None = None, services: Mapping[str, Any] | None = None
    ) -> None:
        from websockets.sync.server import serve

        self.topics, self.services = dict(topics or {}), dict(services or {})
        self.asked: list[dict[str, Any]] = []
        self.heard = threading.Condition()
        self._sockets: list[Any] = []
        quick = {"compression": None, "max_size": None, "ping_interval": None, "close_timeout": 0.5}
        self._server = serve(self._serve, "127.0.0.1", 0, **quick)
        self._thread = threading.Thread(target=self._server.serve_forever)

    @property
    def url(self) -> str:
        """For a client."""
        return f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"

    def __enter__(self) -> "FakeRosbridge":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.cut()
        self._server.shutdown()
        self._thread.join()

    def cut(self) -> None:
        """Ends all connections without a farewell."""
        for connection in self._sockets:
            with suppress(OSError):
                connection.socket.shutdown(socket.SHUT_RDWR)
        self._sockets.clear()

    def send(self, topic: str, message: Any) -> None:
        """A message to all clients, subscribed or not."""
        for connection in self._sockets:
            connection.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))

    def ops(self) -> list[str]:
        """What was asked, as "op topic"."""
        return [f"{a['op']} {a.get('topic') or a.get('service')}" for a in self.asked]

    def wait_for(self, op: str) -> None:
        """Until that was asked."""
        with self.heard:
            assert self.heard.wait_for(lambda: op in self.ops(), 10)

    def _serve(self, connection: Any) -> None:
        self._sockets.append(connection)
        try:
            for text in connection:
                request = json.loads(text)
                with self.heard:
                    self.asked.append(request)
                    self.heard.notify_all()
                self._answer(connection, request)
        except Exception:  # the connection was cut, here or there
            return

    def _answer(self, connection: Any, request: Mapping[str, Any]) -> None:
        if request["op"] == "subscribe":
            in_parts = False
            for message in self.topics.get(request["topic"], ()):
                if isinstance(message, Broken):
                    in_parts = message is Broken.IN_PARTS
                    self._break(connection, request, message)
                    continue
                text = json.dumps({"op": "publish", "topic": request["topic"], "msg": message})
                for part in _fragments(text) if in_parts else (text,):
                    connection.send(part)
                in_parts = False
        elif request["op"] == "call_service" and request["service"] in self.services:
            values = self.services[request["service"]]
            answer = {"op": "service_response", "service": request["service"], "id": request["id"]}
            connection.send(json.dumps({**answer, "values": values, "result": not isinstance(values, str)}))

    def _break(self, connection: Any, request: Mapping[str, Any], how: Broken) -> None:
        if how is Broken.CUT:
            self.cut()
        elif how is Broken.NONSENSE:
            connection.send("{[}")
        elif how is Broken.REFUSED:
            told = {"op": "status", "level": "error", "msg": "no such topic", "id": request["id"]}
            connection.send(json.dumps(told))


def _fragments(text: str, size: int = 50_000) -> list[str]:
    """As rosbridge splits long messages; it gives `total` as a float."""
    pieces = [text[i : i + size] for i in range(0, len(text), size)]
    total = (len(text) - 1) / size + 1
    return [
        json.dumps({"op": "fragment", "id": 0, "data": piece, "num": k, "total": total})
        for k, piece in enumerate(pieces)
    ]


def image_message(
    pixels: np.ndarray,
    encoding: str,
    *,
    stamp_s: float = 100.0,
    frame_id: str = "color",
    ros: int = 1,
    padding: int = 0,
    big_endian: bool = False,
) -> dict[str, Any]:
    """A sensor_msgs/Image as rosbridge gives it, its rows padded by so many bytes."""
    raw = pixels.astype(pixels.dtype.newbyteorder(">" if big_endian else "<"))
    rows = np.ascontiguousarray(raw).view(np.uint8).reshape(len(pixels), -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=7)
    return {
        "header": {"stamp": _stamp(stamp_s, ros), "frame_id": frame_id, **({"seq": 5} if ros == 1 else {})},
        "height": pixels.shape[0],
        "width": pixels.shape[1],
        "encoding": encoding,
        "is_bigendian": int(big_endian),
        "step": rows.shape[1],
        "data": base64.b64encode(rows.tobytes()).decode(),
    }


def info_message(
    K: np.ndarray, width: int, height: int, *, ros: int = 1, D: Sequence[float] = (), P: Any = None
) -> dict[str, Any]:
    """A sensor_msgs/CameraInfo."""
    P = np.c_[K, np.zeros(3)] if P is None else P
    fields = {"K": K.ravel().tolist(), "D": list(D), "R": np.eye(3).ravel().tolist(), "P": P.ravel().tolist()}
    return {
        "header": {"stamp": _stamp(0.0, ros), "frame_id": "color"},
        "height": height,
        "width": width,
        "distortion_model": "plumb_bob",
        **(fields if ros == 1 else {k.lower(): v for k, v in fields.items()}),
        "binning_x": 0,
        "binning_y": 0,
    }


def _stamp(stamp_s: float, ros: int) -> dict[str, int]:
    whole, rest = divmod(round(stamp_s * 1e9), 10**9)
    return {"secs": whole, "nsecs": rest} if ros == 1 else {"sec": whole, "nanosec": rest}
