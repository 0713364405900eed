"""The server, in a thread beside the program."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import uvicorn
from starlette.applications import Starlette

from torc.errors import InputError, TorcError
from torc.web.app import Site, make_app

_START_S = 20.0


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens there. Raises InputError if it cannot."""
    if not 0 <= port < 65536:
        raise InputError(f"--port must be 0 (any free one) to 65535, not {port}.")
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise InputError(
            f"Cannot listen on {host} port {port}: {error}. Choose another --host or --port (--port 0 takes any free "
            "one)."
        ) from error


@contextmanager
def serving(site: Site, sock: socket.socket, token: str | None) -> Iterator[int]:
    """Serve in a thread while the block runs, then close the socket of `listen`; yields the port."""
    port = sock.getsockname()[1]
    with serving_app(make_app(site, token, port), sock):
        yield port


@contextmanager
def serving_app(app: Starlette, sock: socket.socket) -> Iterator[None]:
    """Serve any application like `serving`; its `state.closing` is set at the end."""
    # No access log: addresses may hold the token.
    # No web sockets: uvicorn would import a library for them wherever one is installed.
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, lifespan="off", ws="none", timeout_graceful_shutdown=1
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, args=([sock],), name="torc-web", daemon=True)
    thread.start()
    deadline = time.monotonic() + _START_S
    while not server.started and thread.is_alive() and time.monotonic() < deadline:
        time.sleep(0.02)
    if not server.started:
        raise TorcError("The local server did not start. Try another --port.")
    try:
        yield
    finally:
        app.state.closing.set()
        server.should_exit = True
        thread.join(timeout=5)
        sock.close()


def address(host: str, port: int, token: str | None) -> str:
    """Return the address to open in a browser."""
    shown = socket.gethostname() if host in ("0.0.0.0", "::", "") else host
    shown = f"[{shown}]" if ":" in shown else shown
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
