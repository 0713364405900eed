"""The server, in a thread, and who may talk to it: this machine's own pages, or whoever has the token.

Without a token the server is bound to the loopback interface. Then a page from elsewhere must not reach it through the
user's browser: neither under another name that resolves to 127.0.0.1 (checked by the Host header), nor by a form or
script of another site (checked by Origin and Sec-Fetch-Site).
"""

import hmac
import secrets
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address
from urllib.parse import urlsplit

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from torc.errors import InputError, TorcError

_START_S = 20.0
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; media-src 'self'; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def token_for(host: str) -> str | None:
    """Return a fresh token if others can reach the server, None if only this machine can."""
    return None if _is_loopback(host) else secrets.token_urlsafe(24)


class Gate:
    """Middleware that refuses strangers, and adds the headers that keep a page from loading anything from elsewhere."""

    def __init__(self, app: ASGIApp, token: str | None, port: int) -> None:
        self._app, self._token, self._port = app, token, port
        # Cookies are shared by all ports of a host.
        self._cookie = f"torc-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        if scope["type"] == "http":
            await (self._refusal(Request(scope)) or self._app)(scope, receive, with_headers)

    def _refusal(self, request: Request) -> Response | None:
        if not self._same_site(request):
            text = "This request comes from another site or under another name, and is refused.\n"
            return PlainTextResponse(text, 403)
        bearer = request.headers.get("authorization", "").removeprefix("Bearer ")
        given = (bearer, request.cookies.get(self._cookie, ""))
        if self._token is None or any(map(self._is_token, given)):
            return None
        if request.method != "GET" or not self._is_token(request.query_params.get("token", "")):
            text = "This page needs the token. Open the address that torc printed when it started (?token=...).\n"
            return PlainTextResponse(text, 401)
        # From the address into a cookie, so that it does not stay in the address bar.
        response = RedirectResponse("/", 303)
        response.set_cookie(self._cookie, self._token, httponly=True, samesite="strict")
        return response

    def _same_site(self, request: Request) -> bool:
        host, origin = request.headers.get("host", ""), request.headers.get("origin")
        if self._token is None and not self._is_own_name(host):
            return False
        if origin is not None and urlsplit(origin).netloc != host:
            return False
        site = request.headers.get("sec-fetch-site", "same-origin")
        return request.method in ("GET", "HEAD") or site in ("same-origin", "none")

    def _is_own_name(self, host: str) -> bool:
        try:
            parts = urlsplit(f"//{host}")
            return _is_loopback(parts.hostname or "") and (parts.port or 80) == self._port
        except ValueError:
            return False

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode("utf-8", "replace"), str(self._token).encode())


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


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
def serving_app(app: Starlette, sock: socket.socket) -> Iterator[None]:
    """Serve in a thread while the block runs, then set the application's `state.closing` and close the socket."""
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
    shown = socket.gethostname() if host in ("0.0.0.0", "::", "") else host
    shown = f"[{shown}]" if ":" in shown else shown
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
