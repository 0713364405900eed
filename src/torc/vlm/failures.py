"""A model's server that gives no reply: what happened, and what the user can do. Never a wrong answer or a score."""

from enum import StrEnum

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
RETRYABLE = frozenset(FailureKind) - LASTING
"""Failures that may be temporary."""

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
