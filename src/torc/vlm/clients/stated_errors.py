"""An error that a server states inside an ordinary answer (HTTP 200), as gateways do when the server behind them fails.

Forms: {"error": {"message": ..., "code": 503}} (OpenAI's, OpenRouter's, Google's), {"type": "error", "error": {"type":
"overloaded_error", ...}} (Anthropic's), {"error": "..."}, {"object": "error", "message": ..., "code": ...}; any of them
may be the only entry of a list, or take the place of the first choice.
"""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from torc.vlm.failures import FailureKind, kind_of_status

_ANSWERS = ("choices", "candidates", "content")
"""Keys of the vendors' answers."""
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
    """Return the error that an answer states; None if it holds a reply, or neither."""
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
    codes = [error[name] for name in ("code", "status", "type") if error.get(name) not in (None, "", 0)]
    message = error.get("message")
    words = " ".join([*(str(c) for c in codes[:1]), str(message or error)])
    return StatedError(_kind(codes), words)


def _kind(codes: list[Any]) -> FailureKind:
    """Classify by the first numeric code, else by the first known words; otherwise the error may be temporary."""
    for code in codes:
        if re.fullmatch(r"[45][0-9]{2}", str(code)):
            return kind_of_status(int(code))
    said = " ".join(str(code) for code in codes)
    return next((kind for pattern, kind in _WORDS if pattern.search(said)), FailureKind.SERVER)
