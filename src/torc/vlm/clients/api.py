"""Ask a vendor's server over HTTP: keys, proxies, deadline, retries and scrubbing, equal for all vendors.

Keys are read only from the environment, sent only to their server, and scrubbed from everything that comes back.
"""

import json
import os
import re
import time
from http.client import HTTPException
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.request import HTTPRedirectHandler, ProxyHandler, Request, build_opener

from torc.errors import InputError
from torc.vlm.clients.proxies import find_proxy
from torc.vlm.clients.vendors import VENDORS
from torc.vlm.config import VlmConfig
from torc.vlm.failures import LASTING, FailureKind, VlmError, kind_of_status, stated_error
from torc.vlm.protocol import Finish, Question, Reply
from torc.vlm.replies import reply_of

OWN_SERVER_VARIABLE = "TORC_VLM_API_KEY"
"""The key for a server at a user's address. A vendor's key is never sent there."""
VARIABLES = {
    "gemini": ("GOOGLE_API_KEY", "GEMINI_API_KEY"),
    "openai": ("OPENAI_API_KEY",),
    "anthropic": ("ANTHROPIC_API_KEY",),
}
"""Environment variables by provider; the first that is set counts."""
_ENCODED = re.compile(r"[A-Za-z0-9+/_=-]{120,}")
_MAX_TEXT = 200_000
MAX_WAIT_S = 60.0
"""Longest wait before a retry, seconds; if a server asks for more (a daily quota), the client gives up at once."""
_TOO_SHORT = 3
"""A proxy's secrets up to this length are not scrubbed: they occur in ordinary words."""
_MAX_DETAIL = 300
_MAX_BODY = 100_000
_TUNNEL_REFUSED = "Tunnel connection failed: 407"
_MESSAGE = re.compile(r'"message":\s*"([^"]*)"')
_RETRY_INFO = re.compile(r'"retryDelay":\s*"([0-9.]+)s"')
_Failure = tuple[FailureKind, str, float | None]
"""Kind, the server's words, and the wait that it asks for, seconds."""


class _NoRedirects(HTTPRedirectHandler):
    """Refuses redirects, which would send the key and images elsewhere."""

    def redirect_request(self, *_: Any) -> None:
        """Refuse."""


def open_api_client(config: VlmConfig) -> "ApiClient":
    """Return a client of the model's server; nothing is sent yet. Raises InputError without a key."""
    return ApiClient(config, find_key(config))


class ApiClient:
    """A VlmClient over the network. It opens a connection per request and scrubs the key from everything that comes
    back.
    """

    def __init__(self, config: VlmConfig, key: str | None) -> None:
        self.config, self._key = config, key
        self._proxy = find_proxy(config.url)
        proxies = {} if self._proxy is None else {self._proxy.scheme: self._proxy.url}
        self._opener = build_opener(_NoRedirects, ProxyHandler(proxies))

    def ask(self, question: Question) -> Reply:
        """Return the model's reply. Raises VlmError once the retries are used up, or at once if no retry can help."""
        for tries in range(1, self.config.retries + 2):
            outcome = self._send(question)
            if isinstance(outcome, Reply):
                return outcome
            kind, detail, asked_s = outcome
            wait_s = self.config.retry_wait_s * 2.0 ** (tries - 1) if asked_s is None else asked_s
            too_long = asked_s is not None and asked_s > MAX_WAIT_S
            if kind in LASTING or tries > self.config.retries or too_long:
                break
            time.sleep(min(MAX_WAIT_S, wait_s))
        if too_long:
            detail = f"it asks to wait {asked_s:g} s; {detail}"
        if self._proxy is not None:
            detail = self._proxy.without_secrets(detail)
        detail = " ".join(scrubbed(detail, self._key).split())[:_MAX_DETAIL]
        if self._proxy is not None:
            detail += f"; {self._proxy.words()}"
        raise VlmError(self.config.text, kind, detail, tries)

    def _send(self, question: Question) -> Reply | _Failure:
        """Send the question once. A failure is a value: an exception's context would print unscrubbed text."""
        vendor = VENDORS[self.config.provider]
        path, headers, body = vendor.post(self.config, question, self._key)
        headers |= {"content-type": "application/json", "user-agent": "torc"}
        request = Request(self.config.url.rstrip("/") + path, json.dumps(body).encode(), headers)
        started = time.perf_counter()
        try:
            data = json.loads(self._response_to(request))
            if stated := stated_error(data):
                text = json.dumps(data)[:_MAX_BODY]
                asked_s = None if stated.kind in LASTING else _retry_after_s(None, text)
                return stated.kind, f"error in an answer of HTTP 200: {stated.words}", asked_s
            reply = vendor.read(data)
        except (OSError, HTTPException) as error:
            return _failure(error)
        except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
            return FailureKind.BAD_RESPONSE, type(error).__name__, None
        text = scrubbed(reply.text, self._key)
        version = scrubbed(reply.model_version, self._key)[:_MAX_DETAIL]
        empty = reply.finish is Finish.COMPLETE and not text.strip()
        finish = Finish.EMPTY if empty else reply.finish
        return reply_of(text, version, finish, reply.tokens, time.perf_counter() - started)

    def _response_to(self, request: Request) -> bytes:
        """Read the whole body before the deadline; the connection's own time-out covers only the gap between bytes."""
        deadline, content = time.monotonic() + self.config.timeout_s, b""
        with self._opener.open(request, timeout=self.config.timeout_s) as response:
            while piece := response.read1(65536):
                content += piece
                if time.monotonic() > deadline:
                    raise TimeoutError
        return content


def _failure(error: Exception) -> _Failure:
    """Classify an error of the connection or of the server."""
    if isinstance(error, HTTPError):
        with error:
            text = error.read(_MAX_BODY).decode(errors="replace")
        # OpenAI's 429 that waiting does not cure, and Google's wrong key, which arrives as an ordinary 400.
        refused = "insufficient_quota" in text or "API_KEY_INVALID" in text
        kind = FailureKind.AUTH if refused else kind_of_status(error.code)
        message = _MESSAGE.search(text)
        detail = f"HTTP {error.code} {message.group(1) if message else text}"
        return kind, detail, None if refused else _retry_after_s(error, text)
    reason = error.reason if isinstance(error, URLError) else error
    if isinstance(reason, TimeoutError):
        return FailureKind.TIMEOUT, "the server did not answer in time", None
    if _TUNNEL_REFUSED in str(reason):
        return FailureKind.PROXY, str(reason), None
    return FailureKind.CONNECTION, f"{type(reason).__name__}: {reason}", None


def _retry_after_s(error: HTTPError | None, text: str) -> float | None:
    """Return the wait from the header, or from Google's RetryInfo in the body, seconds; None for a date."""
    info = _RETRY_INFO.search(text)
    try:
        seconds = float(info.group(1) if info else error.headers.get("retry-after", "") if error else "")
    except ValueError:
        return None
    return seconds if 0 <= seconds < 1e6 else None


def find_key(config: VlmConfig) -> str | None:
    """Return the key for a model's server; None for a user's server that needs none.

    Raises:
        InputError: a vendor's key is missing from the environment, or cannot be a key.
    """
    names = VARIABLES[config.provider] if config.base_url is None else (OWN_SERVER_VARIABLE,)
    name = next((n for n in names if os.environ.get(n, "").strip()), None)
    if name is None:
        if config.base_url is not None:
            return None
        raise InputError(
            f"No key for {config.provider} in the environment. Set it with: export {names[-1]}=... "
            "(keys are never read from files or arguments)."
        )
    key = os.environ[name].strip()
    if not key.isascii() or not key.isprintable() or " " in key:
        raise InputError(f"The key in {name} holds characters that no key has. Copy it again.")
    return key


def scrubbed(text: str, key: str | None) -> str:
    """Return a server's text without the key and without long encoded data (an echoed image), and bounded in length."""
    text = text[:_MAX_TEXT].encode("utf-8", "replace").decode()
    if key:
        text = text.replace(key, "[key]")
    return _ENCODED.sub("[data]", text)
