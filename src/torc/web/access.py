"""Who may talk to the server: this machine's own pages, or whoever has the token.

Without a token the server is bound to the loopback interface. Then a page from elsewhere must not reach it through
the user's browser: neither under another name that resolves to 127.0.0.1 (the Host header tells), nor by a form or
script of another site (Origin and Sec-Fetch-Site tell).
"""

import hmac
import secrets
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import parse_qs, urlencode, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from torc.errors import InputError

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
_NO_TOKEN = (
    "This page needs the token. Open the address that torc printed when it started; it ends in ?token=...\n"
)
_FOREIGN = "This request comes from another site or under another name, and is refused.\n"
_SAFE = ("GET", "HEAD")


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches a server that is bound there."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def token_for(host: str) -> str | None:
    """A fresh token where others can reach the server, None where only this machine can."""
    return None if is_loopback(host) else secrets.token_urlsafe(24)


class Gate:
    """Middleware: refuses strangers, and adds the headers that keep a page from loading anything from elsewhere."""

    def __init__(self, app: ASGIApp, token: str | None, port: int) -> None:
        self._app, self._token, self._port = app, token, port
        # Cookies are shared by all ports of a host.
        self._cookie = f"torc-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, or pass it on."""
        if scope["type"] != "http":
            # No page opens a web socket; the life of the server itself is nobody's request.
            if scope["type"] == "lifespan":
                await self._app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        refusal = self._refusal(scope)
        await (refusal or self._app)(scope, receive, with_headers)

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        if not self._same_site(scope["method"], headers):
            return PlainTextResponse(_FOREIGN, 403)
        if self._token is None or self._knows_token(headers):
            return None
        return self._let_in(scope) or PlainTextResponse(_NO_TOKEN, 401)

    def _same_site(self, method: str, headers: Headers) -> bool:
        host = headers.get("host", "")
        if self._token is None and not self._is_own_name(host):
            return False
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return False
        return method in _SAFE or headers.get("sec-fetch-site", "same-origin") in ("same-origin", "none")

    def _is_own_name(self, host: str) -> bool:
        try:
            parts = urlsplit(f"//{host}")
            return is_loopback(parts.hostname or "") and (parts.port or 80) == self._port
        except ValueError:
            return False

    def _knows_token(self, headers: Headers) -> bool:
        bearer = headers.get("authorization", "").removeprefix("Bearer ")
        try:
            cookies = SimpleCookie(headers.get("cookie", ""))
        except CookieError:
            cookies = SimpleCookie()
        cookie = cookies[self._cookie].value if self._cookie in cookies else ""
        return self._is_token(bearer) or self._is_token(cookie)

    def _is_token(self, text: str) -> bool:
        return self._token is not None and hmac.compare_digest(
            text.encode("utf-8", "replace"), self._token.encode()
        )

    def _let_in(self, scope: Scope) -> Response | None:
        """Take the token out of the address into a cookie, so that it does not stay in the address bar."""
        query = parse_qs(scope["query_string"].decode("latin-1"))
        if scope["method"] != "GET" or not self._is_token(query.pop("token", [""])[0]):
            return None
        rest = urlencode(query, doseq=True)
        response = RedirectResponse("/" + (f"?{rest}" if rest else ""), 303)
        response.set_cookie(self._cookie, str(self._token), httponly=True, samesite="strict", path="/")
        return response


def check_port(port: int) -> None:
    """Raises InputError for what is no port."""
    if not 0 <= port < 65536:
        raise InputError(f"--port must be 0 (any free one) to 65535, not {port}.")
