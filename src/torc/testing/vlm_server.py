"""Fake VLM servers on the loopback interface: they speak the vendors' wire formats and do what a test tells them.

They say that they are fakes: in their `Server` header, and in the model version of every reply.
"""

import json
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any

from torc.testing.vlm_wire_formats import FORMATS, Asked, Fail, Say


@dataclass(frozen=True)
class Late:
    """The reply comes after this time."""

    seconds: float
    say: Say


@dataclass(frozen=True)
class Drip:
    """A reply byte by byte that never ends, fast enough that no byte is late."""

    interval_s: float = 0.02


@dataclass(frozen=True)
class CutOff:
    """The connection ends amid the reply; or before it, if `after_bytes` is 0."""

    say: Say
    after_bytes: int = 40


@dataclass(frozen=True)
class Raw:
    """Any body."""

    body: bytes
    content_type: str = "application/json"
    status: int = 200


@dataclass(frozen=True)
class Redirect:
    """The client is sent elsewhere."""

    to: str


Behaviour = Say | Fail | Late | Drip | CutOff | Raw | Redirect


class FakeVlmServer:
    """A fake server of one provider's kind; a context manager.

    Args:
        provider: "gemini", "openai" or "anthropic".
        script: what it does, request by request; the last repeats.
        key: refuses requests that bring another key; None takes any.

    Attributes:
        asked: the requests that kept to the format, in order.
        headers: of all requests.
    """

    def __init__(self, provider: str, script: Iterable[Behaviour], key: str | None = None) -> None:
        self.format, self.key = FORMATS[provider], key
        self.asked: list[Asked] = []
        self.headers: list[dict[str, str]] = []
        self.stopping = threading.Event()
        self._script, self._lock = list(script), threading.Lock()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.01})

    @property
    def url(self) -> str:
        """Base URL for a client."""
        return f"http://127.0.0.1:{self._server.server_port}{self.format.base_path}"

    def __enter__(self) -> "FakeVlmServer":
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.stopping.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()

    def next_behaviour(self) -> Behaviour:
        """What the next request gets."""
        with self._lock:
            return self._script.pop(0) if len(self._script) > 1 else self._script[0]

    def judge(self, path: str, headers: dict[str, str], body: bytes) -> Fail | None:
        """Records a request; the error that a real server would report of it, if any."""
        self.headers.append(headers)
        try:
            asked = self.format.read(path, headers, json.loads(body))
        except LookupError as error:
            missing = error.args[0] if error.args else error
            return Fail(404 if str(missing).startswith("/") else 400, f"missing or unknown: {missing}")
        except (TypeError, ValueError) as error:
            return Fail(400, f"bad request: {error}")
        if self.key is not None and asked.key != self.key:
            return Fail(401, f"Incorrect API key provided: {asked.key}")
        self.asked.append(asked)
        return None


def _handler(fake: FakeVlmServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        server_version = "torc.testing-fake-vlm"
        sys_version = ""

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers.get("content-length", 0)))
            headers = {name.lower(): value for name, value in self.headers.items()}
            fault = fake.judge(self.path.partition("?")[0], headers, body)
            try:
                self.behave(fault or fake.next_behaviour())
            except OSError:  # the client went away
                self.close_connection = True

        def behave(self, behaviour: Behaviour) -> None:
            match behaviour:
                case Say():
                    self.answer(200, fake.format.reply(behaviour))
                case Fail():
                    content, headers = fake.format.error(behaviour)
                    # Google's code for a wrong key differs from the others'.
                    status = content["error"].get("code")
                    self.answer(status if isinstance(status, int) else behaviour.status, content, headers)
                case Late():
                    fake.stopping.wait(behaviour.seconds)
                    self.answer(200, fake.format.reply(behaviour.say))
                case Drip():
                    self.drip(behaviour.interval_s)
                case CutOff():
                    self.cut_off(json.dumps(fake.format.reply(behaviour.say)).encode(), behaviour.after_bytes)
                case Raw():
                    self.send(behaviour.status, behaviour.body, {"content-type": behaviour.content_type})
                case Redirect():
                    self.send(307, b"", {"location": behaviour.to})

        def answer(self, status: int, content: Any, headers: dict[str, str] | None = None) -> None:
            form = {"content-type": "application/json", **(headers or {})}
            self.send(status, json.dumps(content).encode(), form)

        def send(self, status: int, body: bytes, headers: dict[str, str], length: int | None = None) -> None:
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.send_header("content-length", str(len(body) if length is None else length))
            self.end_headers()
            self.wfile.write(body)

        def cut_off(self, body: bytes, after_bytes: int) -> None:
            if after_bytes:
                self.send(200, body[:after_bytes], {"content-type": "application/json"}, length=len(body))
            self.close_connection = True

        def drip(self, interval_s: float) -> None:
            self.send(200, b"{", {"content-type": "application/json"}, length=10**9)
            while not fake.stopping.is_set():
                self.wfile.write(b" ")
                time.sleep(interval_s)

        def log_message(self, format: str, *arguments: Any) -> None:
            """Nothing on stderr."""

    return Handler
