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
    BAD_RESPONSE = "not an answer of this kind of server"


RETRYABLE = frozenset(
    {
        FailureKind.RATE_LIMIT,
        FailureKind.SERVER,
        FailureKind.TIMEOUT,
        FailureKind.CONNECTION,
        FailureKind.BAD_RESPONSE,
    }
)
"""What may pass by itself."""

REMEDIES = {
    FailureKind.AUTH: "Check the key in the environment; it may belong to another vendor or lack access to the model.",
    FailureKind.NOT_FOUND: "Check the model's name and the URL.",
    FailureKind.BAD_REQUEST: "The model may not know an option: try without --vlm-thinking or --vlm-temperature, or "
    "with --vlm-free-text.",
    FailureKind.RATE_LIMIT: "Wait, ask less at once, or raise --vlm-retries.",
    FailureKind.SERVER: "Try again later.",
    FailureKind.TIMEOUT: "Raise --vlm-timeout, or choose a faster model.",
    FailureKind.CONNECTION: "Check that the server runs and that the URL is right.",
    FailureKind.BAD_RESPONSE: "Check the URL (OpenAI-compatible servers mostly end in /v1) and the kind of server.",
}


class VlmError(TorcError):
    """A model could not be asked. A trial in which this happens is errored.

    Attributes:
        kind: why.
    """

    def __init__(self, model: str, kind: FailureKind, detail: str, tries: int) -> None:
        asked = "once" if tries == 1 else f"{tries} times"
        super().__init__(
            f"The VLM {model} gave no reply, asked {asked}: {kind.value} ({detail}). {REMEDIES[kind]}"
        )
        self.kind = kind


class SendFailure(Exception):  # noqa: N818 - a value between a vendor's module and the retries, never seen outside
    """One request that brought no reply.

    Attributes:
        kind: why.
        detail: the server's words; may hold anything, so it is scrubbed before anybody sees it.
        retry_after_s: how long the server asks to wait, if it says.
    """

    def __init__(self, kind: FailureKind, detail: str, retry_after_s: float | None = None) -> None:
        super().__init__(kind.value)
        self.kind, self.detail, self.retry_after_s = kind, detail, retry_after_s


def kind_of_status(status: int) -> FailureKind:
    """What an HTTP status means, for all vendors."""
    if status in (401, 403):
        return FailureKind.AUTH
    if status == 404:
        return FailureKind.NOT_FOUND
    if status == 408:
        return FailureKind.TIMEOUT
    if status == 429:
        return FailureKind.RATE_LIMIT
    if status >= 500:
        return FailureKind.SERVER
    return FailureKind.BAD_REQUEST if status >= 400 else FailureKind.BAD_RESPONSE
