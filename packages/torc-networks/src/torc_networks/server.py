"""A small server of networks: ZeroMQ's REP, a function per action. For torc's own parts, and for the files in servers/.

It needs pyzmq, msgpack, numpy and jaxtyping alone, so that it runs in a network's own environment.
"""

import threading
import traceback
from collections.abc import Callable, Mapping
from typing import Any

import torc
from torc import InputError, TorcError
from torc.interrupts import ended_like_ctrl_c
from torc_networks.addresses import OPEN, is_loopback
from torc_networks.wire import MAX_BYTES, decode, encode, library

Handler = Callable[[Mapping[str, Any]], Mapping[str, Any]]
"""From the fields of a request to those of its answer; what it raises becomes {"error": text}."""
_LOOK_MS = 50
_MOST_TEXT = 2000


class NetworkServer:
    """Listens from the start, and answers while `run` runs. Use it in a `with`.

    Args:
        handlers: by action; `health` and `metadata` are added.
        name: its name in `metadata`.
        port: 0 for any free one.
        host: where to listen; only with `remote` other than this machine's loopback address.
        remote: allow other machines.
        max_bytes: longest message.
        say: is given lines for whoever watches the server.

    Raises:
        InputError: it cannot listen there.
        MissingDependencyError: pyzmq is not installed.
    """

    def __init__(
        self,
        handlers: Mapping[str, Handler],
        name: str = "torc",
        port: int = 0,
        host: str = "127.0.0.1",
        remote: bool = False,
        max_bytes: int = MAX_BYTES,
        say: Callable[[str], None] = print,
    ) -> None:
        if not is_loopback(host) and not remote:
            raise InputError(
                f"--host {host} is not this machine alone. {OPEN} Add --remote if you want that."
            )
        if not 0 <= port < 65536:
            raise InputError(f"--port must be 0 (any free one) to 65535, not {port}.")
        zmq = library("zmq")
        self.handlers, self.name, self.max_bytes, self.say = dict(handlers), name, max_bytes, say
        self._socket = zmq.Context.instance().socket(zmq.REP)
        self._socket.maxmsgsize = max_bytes
        self._socket.linger = 1000  # the last answer may still be on its way
        self._socket.ipv6 = ":" in host
        shown = f"[{host}]" if ":" in host else host.replace("localhost", "127.0.0.1")
        try:
            self._socket.bind(f"tcp://{shown}:{port or '*'}")
        except zmq.ZMQError as error:
            self._socket.close(linger=0)
            raise InputError(
                f"Cannot listen on {host} port {port}: {error}. Choose another --port."
            ) from error
        self.address: str = self._socket.last_endpoint.decode()

    def run(self, stop: threading.Event | None = None) -> None:
        """Answer one request after the other until `stop` is set."""
        while stop is None or not stop.is_set():
            # A wait without end does not always notice Ctrl-C.
            if self._socket.poll(_LOOK_MS):
                self._socket.send(self._answered(b"".join(self._socket.recv_multipart())))

    def __enter__(self) -> "NetworkServer":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def _answered(self, packed: bytes) -> bytes:
        try:
            request = decode(packed)
            return encode(dict(self._handled(request.pop("action", None), request)), self.max_bytes)
        except TorcError as error:
            text = str(error)
        except Exception as error:  # a handler may fail in any way, and the next request must be answered
            self.say(traceback.format_exc())
            text = f"{type(error).__name__}: {error}"
        return encode({"error": text[:_MOST_TEXT].encode("utf-8", "replace").decode()})

    def _handled(self, action: Any, fields: Mapping[str, Any]) -> Mapping[str, Any]:
        if action == "health":
            return {"status": "ok"}
        if action == "metadata":
            return {"name": self.name, "actions": sorted(self.handlers), "torc": torc.__version__}
        handler = self.handlers.get(str(action))
        if handler is None:
            known = ", ".join(["health", "metadata", *sorted(self.handlers)])
            raise InputError(f"There is no action {str(action)[:40]!r} here; there are {known}.")
        return handler(fields)


def serve(
    handlers: Mapping[str, Handler], name: str, port: int, host: str = "127.0.0.1", remote: bool = False
) -> None:
    """Serve until Ctrl-C or SIGTERM; print what is served and where. Arguments as for NetworkServer."""
    with ended_like_ctrl_c(), NetworkServer(handlers, name, port, host, remote) as server:
        try:
            server.say(f"{name} answers {', '.join(sorted(handlers))} at {server.address}\nCtrl-C ends it.")
            if not is_loopback(host):
                server.say(OPEN)
            server.run()
        except KeyboardInterrupt:
            server.say("")
