"""What twins share: TCP servers on the loopback interface, and protocols of the simulated arm and fingers."""

import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from socketserver import BaseRequestHandler, ThreadingTCPServer
from typing import Any, Protocol, Self

import numpy as np

from torc_lab.robotiq.registers import Object

HALFWAY_RAD = 0.2
"""An arm this close to its goal may still arrive after a stop, because it lags behind its set points."""
PERIOD_S = 0.004
"""Time between two set points of an arm."""
_POLL_S = 0.05
Serve = Callable[[socket.socket], None]
"""Serves a connection until it ends. An OSError, or a message cut off in the middle, ends it quietly."""


class ArmBehind(Protocol):
    """An arm that follows set points, each given when the arm has to be there."""

    @property
    def qpos(self) -> np.ndarray:
        """Return the joint positions, radians."""

    def goal(self, qpos: np.ndarray) -> None:
        """Set where the arm has to be now, radians."""

    @property
    def contact_n(self) -> float:
        """Return the force at the hardest contact, except with the held object, newtons."""


class Fingers(Protocol):
    """A gripper's fingers. Positions are 0 (open) to 255 (closed)."""

    def go(self, position: int, speed: int, force: int) -> None:
        """Start moving towards a position."""

    def now(self) -> tuple[int, Object]:
        """Return the position, and whether something stopped the fingers."""


class _Server(ThreadingTCPServer):
    allow_reuse_address = daemon_threads = True

    def __init__(self, address: tuple[str, int], serve: Serve) -> None:
        super().__init__(address, BaseRequestHandler)
        self._serve = serve
        self.connections: list[socket.socket] = []

    def finish_request(self, request: Any, client_address: Any) -> None:
        request.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connections.append(request)
        with suppress(OSError, ValueError):
            self._serve(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        raise  # of its thread, as anywhere else


class TcpTwin:
    """Serve TCP ports during a `with`, with a thread per connection, and repeat a step meanwhile."""

    def __init__(
        self, host: str, serves: Sequence[tuple[int, Serve]], step: Callable[[], None] | None = None
    ) -> None:
        """Bind the ports of `serves` (0: any free port). Raises OSError if one is taken."""
        self.host, self._running, self._servers = host, True, list[_Server]()
        try:
            for port, serve in serves:
                self._servers.append(_Server((host, port), serve))
        except OSError:
            for server in self._servers:
                server.server_close()
            raise
        loops: list[Callable[[], None]] = [partial(server.serve_forever, _POLL_S) for server in self._servers]
        if step is not None:
            loops.append(lambda: self._repeat(step))
        self._threads = [threading.Thread(target=loop, daemon=True) for loop in loops]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        for server in self._servers:
            server.shutdown()
            server.server_close()
        self.cut()
        for thread in self._threads:
            thread.join()

    @property
    def ports(self) -> tuple[int, ...]:
        """Return the bound ports, in the order of `serves`."""
        return tuple(int(server.server_address[1]) for server in self._servers)

    def cut(self) -> None:
        """End all connections abruptly, without a closing message."""
        for server in self._servers:
            for connection in server.connections:
                with suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)
            server.connections.clear()

    def _repeat(self, step: Callable[[], None]) -> None:
        while self._running:
            step()
            time.sleep(PERIOD_S)
