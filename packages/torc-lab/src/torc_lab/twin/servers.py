"""TCP servers on the loopback interface, for twins: a thread per connection, and a cable that can be cut."""

import socket
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Self

Serve = Callable[[socket.socket], None]
"""Speaks on a connection until it ends. An OSError, or a message cut off in the middle, ends it quietly."""


class Servers:
    """A server per port, in a `with`."""

    def __init__(self, host: str, serves: Sequence[tuple[int, Serve]]) -> None:
        """Ports, 0 for any, and who serves there. Raises OSError if one is taken."""
        self.host, self._connections = host, list[socket.socket]()
        self._servers: list[socket.socket] = []
        try:
            for port, _ in serves:
                self._servers.append(socket.create_server((host, port)))
        except OSError:
            self._close()
            raise
        self._threads = [
            threading.Thread(target=self._accept, args=(server, serve), daemon=True)
            for server, (_, serve) in zip(self._servers, serves, strict=True)
        ]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._close()
        self.cut()
        for thread in self._threads:
            thread.join()

    @property
    def ports(self) -> tuple[int, ...]:
        """In the order of who serves there."""
        return tuple(int(server.getsockname()[1]) for server in self._servers)

    def cut(self) -> None:
        """Ends all connections without a farewell."""
        for connection in self._connections:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
        self._connections.clear()

    def _close(self) -> None:
        for server in self._servers:
            with suppress(OSError):
                server.shutdown(socket.SHUT_RDWR)
            server.close()

    def _accept(self, server: socket.socket, serve: Serve) -> None:
        with suppress(OSError):  # the server was closed
            while True:
                connection, _ = server.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._connections.append(connection)
                threading.Thread(target=_quietly, args=(serve, connection), daemon=True).start()


def _quietly(serve: Serve, connection: socket.socket) -> None:
    with suppress(OSError, ValueError):
        serve(connection)
