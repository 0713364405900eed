"""What a vendor's module does: one request, its reply in common terms. All else is shared."""

from dataclasses import dataclass
from typing import Any, Protocol

from torc.errors import MissingDependencyError, extra_remedy
from torc.vlm.protocol import Finish, Question, Tokens

NO_KEY = "no-key"
"""Sent to servers that need no key: without one the vendors' libraries look for one in the environment."""


@dataclass(frozen=True)
class WireReply:
    """A reply as a server gave it, not yet scrubbed.

    Attributes:
        text: what the model wrote, without its hidden thinking.
        finish: how it ended.
        model_version: the model, as the server names it.
        tokens: what it took.
    """

    text: str
    finish: Finish
    model_version: str
    tokens: Tokens


class Wire(Protocol):
    """An open connection to one vendor's kind of server."""

    def send(self, question: Question) -> WireReply:
        """One request, no retries. Raises SendFailure, whatever goes wrong."""
        ...

    def close(self) -> None:
        """Ends what is in flight."""
        ...


def finished(finish: Finish, text: str) -> Finish:
    """A reply that claims to be complete and is blank is an empty one."""
    return Finish.EMPTY if finish is Finish.COMPLETE and not text.strip() else finish


def count(value: Any) -> int | None:
    """A number of tokens from a server, or None for what is none."""
    return value if isinstance(value, int) and not isinstance(value, bool) and value >= 0 else None


def seconds_in(value: Any) -> float | None:
    """A waiting time such as "30" or "30s"; None for anything else (a date, for one)."""
    try:
        seconds = float(str(value).removesuffix("s"))
    except ValueError:
        return None
    return seconds if 0 <= seconds < 1e6 else None


def missing(extra: str) -> MissingDependencyError:
    """The error of a vendor's library that is not installed."""
    return MissingDependencyError(f"The library for {extra} models", extra_remedy(extra))
