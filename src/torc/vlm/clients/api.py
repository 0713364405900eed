"""Asks a server over a vendor's wire: deadline, retries, scrubbing; the same for all vendors."""

import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from importlib import import_module
from types import MappingProxyType
from typing import Any

from torc.vlm.clients.wire import Wire
from torc.vlm.config import VlmConfig
from torc.vlm.failures import RETRYABLE, FailureKind, VlmError, kind_of_status
from torc.vlm.keys import find_key, scrubbed
from torc.vlm.protocol import Finish, Question, Reply
from torc.vlm.replies import reply_of

MAX_WAIT_S = 60.0
"""A server that asks for a longer wait (a day's quota) is given up at once; own waits grow no longer."""
_MAX_DETAIL = 300
_WIRES: Mapping[str, str] = MappingProxyType(
    {
        "gemini": "torc.vlm.clients.gemini:GeminiWire",
        "openai": "torc.vlm.clients.openai_compatible:OpenAiWire",
        "anthropic": "torc.vlm.clients.claude:AnthropicWire",
    }
)
"""Provider -> "module:Class"; a vendor's library is imported when its client is opened, not before."""
_LOST = (
    "ConnectError",
    "ConnectionError",
    "ReadError",
    "WriteError",
    "ProtocolError",
    "NetworkError",
    "ProxyError",
)
"""How the names of errors of a lost connection end."""


def open_api_client(config: VlmConfig) -> "ApiClient":
    """A client of the model's server; nothing is sent yet.

    Raises InputError without a key, and MissingDependencyError without the vendor's library.
    """
    key = find_key(config)
    module, _, name = _WIRES[config.provider].partition(":")
    wire = getattr(import_module(module), name)
    return ApiClient(config, key, lambda: wire(config, key))


class ApiClient:
    """A VlmClient over the network.

    Args:
        config: model and manner.
        key: scrubbed from all that comes back.
        connect: opens a wire; each request has its own, so that no connection stays open or half read.
    """

    def __init__(self, config: VlmConfig, key: str | None, connect: Callable[[], Wire]) -> None:
        self.config = config
        self._key, self._connect = key, connect
        self._ready: Wire | None = connect()  # at once: a library that is missing shows now, not amid a trial

    def ask(self, question: Question) -> Reply:
        """The model's reply. Raises VlmError once the retries are used up, or at once if no retry can help."""
        for tries in range(1, self.config.retries + 2):
            outcome = self._send(question)
            if isinstance(outcome, Reply):
                return outcome
            kind, detail, asked_s = outcome
            wait_s = self.config.retry_wait_s * 2.0 ** (tries - 1) if asked_s is None else asked_s
            too_long = asked_s is not None and asked_s > MAX_WAIT_S
            if kind not in RETRYABLE or tries > self.config.retries or too_long:
                break
            time.sleep(min(MAX_WAIT_S, wait_s))
        if too_long:
            detail = f"it asks to wait {asked_s:g} s; {detail}"
        raise VlmError(
            self.config.text, kind, " ".join(scrubbed(detail, self._key).split())[:_MAX_DETAIL], tries
        )

    def _send(self, question: Question) -> "Reply | _Failure":
        """A failure comes back as a value: an exception's context would show the vendor's own to whoever prints it."""
        wire, self._ready = self._ready or self._connect(), None
        started = time.perf_counter()
        try:
            reply = _within(self.config.timeout_s, lambda: wire.send(question))
        except Exception as error:  # the library's own errors, and whatever garbage makes of its parser
            return _failure(error)
        finally:
            wire.close()
        text, version = (
            scrubbed(reply.text, self._key),
            scrubbed(reply.model_version, self._key)[:_MAX_DETAIL],
        )
        empty = reply.finish is Finish.COMPLETE and not text.strip()
        finish = Finish.EMPTY if empty else reply.finish
        return reply_of(text, version, finish, reply.tokens, time.perf_counter() - started)


_Failure = tuple[FailureKind, str, float | None]
"""Kind, the server's words, the wait that it asks for."""


def _within(seconds: float, call: Callable[[], Reply]) -> Reply:
    """The call's result; a time-out of an HTTP client counts from one byte to the next.

    Raises what the call raised, and TimeoutError after that many seconds; the call is then left to itself, in a thread
    that does not keep the process alive.
    """
    outcome: Future[Reply] = Future()

    def run() -> None:
        try:
            outcome.set_result(call())
        except BaseException as error:  # handed to the caller
            outcome.set_exception(error)

    threading.Thread(target=run, daemon=True, name="vlm-request").start()
    return outcome.result(seconds)


def _failure(error: Any) -> _Failure:
    """What an error of any vendor's library means."""
    name, code = type(error).__name__, getattr(error, "code", None)
    status = getattr(error, "status_code", code)
    if isinstance(status, int):
        detail = f"HTTP {status} {error.message}"
        # OpenAI's 429 that no waiting mends, and Google's wrong key, which arrives as an ordinary 400.
        refused = code == "insufficient_quota" or "API_KEY_INVALID" in str(getattr(error, "details", ""))
        kind = FailureKind.AUTH if refused else kind_of_status(status)
        return kind, detail, None if refused else _retry_after_s(error)
    if "Timeout" in name:
        return FailureKind.TIMEOUT, "the server did not answer in time", None
    if name.endswith(_LOST):
        return FailureKind.CONNECTION, f"{name}: {error} {error.__cause__ or ''}", None
    return FailureKind.BAD_RESPONSE, name, None


def _retry_after_s(error: Any) -> float | None:
    """From the header, or, for Google, from the RetryInfo among the error's details; None for a date."""
    details = getattr(error, "details", None)
    try:
        if details is None:
            found = error.response.headers["retry-after"]
        else:
            found = next(d["retryDelay"] for d in details["error"]["details"] if "retryDelay" in d)
        seconds = float(found.removesuffix("s"))
    except (AttributeError, LookupError, StopIteration, TypeError, ValueError):
        return None
    return seconds if 0 <= seconds < 1e6 else None
