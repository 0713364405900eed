"""The server, beside whatever else the program does."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import uvicorn
from starlette.applications import Starlette

from torc.errors import InputError, TorcError

_START_S = 20.0


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens there. Raises InputError where it cannot."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise InputError(
            f"Cannot listen on {host} port {port}: {error.strerror or error}. Choose another --host or --port "
            "(--port 0 takes any free one)."
        ) from error


@contextmanager
def serving(make: Callable[[int], Starlette], sock: socket.socket) -> Iterator[int]:
    """Serve in a thread of its own while the block runs.

    Args:
        make: the application for the port that it gets; its `state.closing` is set when the block ends.
        sock: as from `listen`; closed afterwards.

    Yields:
        The port.
    """
    port = sock.getsockname()[1]
    # No access log: addresses may hold the token.
    app = make(port)
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, lifespan="off", timeout_graceful_shutdown=1
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, args=([sock],), name="torc-web", daemon=True)
    thread.start()
    waited = threading.Event()
    for _ in range(round(_START_S / 0.02)):
        if server.started or not thread.is_alive():
            break
        waited.wait(0.02)
    if not server.started:
        raise TorcError("The local server did not start. Try another --port.")
    try:
        yield port
    finally:
        app.state.closing.set()
        server.should_exit = True
        thread.join(timeout=5)
        sock.close()


def address(host: str, port: int, token: str | None) -> str:
    """What to open in a browser."""
    shown = socket.gethostname() if host in ("0.0.0.0", "::", "") else host
    shown = f"[{shown}]" if ":" in shown else shown
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
