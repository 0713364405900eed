"""A model's server that gives no reply: what happened, and what the user can do. Never a wrong answer or a score."""

import re
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, NamedTuple

from torc.errors import TorcError


class FailureKind(StrEnum):
    """Why a server gave no reply."""

    AUTH = "key refused"
    NOT_FOUND = "no such model or address"
    BAD_REQUEST = "request refused"
    RATE_LIMIT = "rate limit"
    SERVER = "server error"
    TIMEOUT = "time-out"
    CONNECTION = "no connection"
    PROXY = "proxy refused"
    BAD_RESPONSE = "not an answer of this kind of server"


LASTING = frozenset({FailureKind.AUTH, FailureKind.NOT_FOUND, FailureKind.BAD_REQUEST, FailureKind.PROXY})
"""Failures that a retry cannot cure."""
REMEDIES = {
    FailureKind.AUTH: "Check the key in the environment; it may belong to another vendor, or lack access to the model "
    "or credit.",
    FailureKind.NOT_FOUND: "Check the model's name and the URL.",
    FailureKind.BAD_REQUEST: "The model may not know an option: try without --vlm-thinking or --vlm-temperature, or "
    "with --vlm-free-text.",
    FailureKind.RATE_LIMIT: "Wait, ask less at once, or raise --vlm-retries.",
    FailureKind.SERVER: "Try again later.",
    FailureKind.TIMEOUT: "Raise --vlm-timeout, or choose a faster model.",
    FailureKind.CONNECTION: "Check that the server runs and that the URL is right.",
    FailureKind.PROXY: "Put the proxy's user and password into http_proxy or https_proxy, or the server's name into "
    "no_proxy.",
    FailureKind.BAD_RESPONSE: "Check the URL (OpenAI-compatible servers mostly end in /v1) and the kind of server.",
}
_KINDS = {
    **dict.fromkeys((401, 402, 403), FailureKind.AUTH),
    404: FailureKind.NOT_FOUND,
    407: FailureKind.PROXY,
    408: FailureKind.TIMEOUT,
    429: FailureKind.RATE_LIMIT,
}
_ANSWERS = ("choices", "candidates", "content")
"""Keys of the vendors' answers."""


class VlmError(TorcError):
    """A model could not be asked, and why (`kind`). A trial in which this happens is errored."""

    def __init__(self, model: str, kind: FailureKind, detail: str, tries: int) -> None:
        asked = "once" if tries == 1 else f"{tries} times"
        super().__init__(
            f"The VLM {model} gave no reply, asked {asked}: {kind.value} ({detail}). {REMEDIES[kind]}"
        )
        self.kind = kind


def kind_of_status(status: int) -> FailureKind:
    """Return the meaning of an HTTP status, for all vendors."""
    if status in _KINDS:
        return _KINDS[status]
    if status >= 500:
        return FailureKind.SERVER
    return FailureKind.BAD_REQUEST if status >= 400 else FailureKind.BAD_RESPONSE


_WORDS = (
    (re.compile(r"quota|credit|billing|payment", re.I), FailureKind.AUTH),
    (re.compile(r"rate.?limit|too.?many|resource.?exhausted|throttl", re.I), FailureKind.RATE_LIMIT),
    (re.compile(r"auth|permission|api.?key|forbidden", re.I), FailureKind.AUTH),
    (re.compile(r"not.?found", re.I), FailureKind.NOT_FOUND),
    (re.compile(r"invalid|bad.?request|failed.?precondition", re.I), FailureKind.BAD_REQUEST),
)
"""Meaning of codes in words; all others, e.g. "overloaded_error", may be temporary."""


class StatedError(NamedTuple):
    """Kind of error, and the server's code and words."""

    kind: FailureKind
    words: str


def stated_error(data: Any) -> StatedError | None:
    """Return the error that an ordinary answer (HTTP 200) states, as gateways do; None if it states none.

    Forms: {"error": {"message": ..., "code": 503}} (OpenAI's, OpenRouter's, Google's), {"type": "error", "error":
    {"type": "overloaded_error", ...}} (Anthropic's), {"error": "..."}, {"object": "error", "message": ..., "code":
    ...}; any of them may be the only entry of a list, or take the place of the first choice.
    """
    if isinstance(data, list) and len(data) == 1:
        data = data[0]
    if not isinstance(data, Mapping):
        return None
    given = next((data[name] for name in _ANSWERS if data.get(name)), None)
    if given is not None:
        first = given[0] if isinstance(given, list) else None
        return _read(first.get("error")) if isinstance(first, Mapping) else None
    if data.get("object") == "error":
        return _read(data)
    return _read(data.get("error"))


def _read(error: Any) -> StatedError | None:
    if isinstance(error, str) and error.strip():
        error = {"message": error}
    if not isinstance(error, Mapping) or not error:
        return None
    codes = [str(error[name]) for name in ("code", "status", "type") if error.get(name) not in (None, "", 0)]
    statuses = [int(code) for code in codes if re.fullmatch(r"[45][0-9]{2}", code)]
    said = " ".join(codes)
    in_words = next((kind for pattern, kind in _WORDS if pattern.search(said)), FailureKind.SERVER)
    kind = kind_of_status(statuses[0]) if statuses else in_words
    return StatedError(kind, " ".join([*codes[:1], str(error.get("message") or error)]))
