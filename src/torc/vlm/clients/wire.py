"""What the vendors' modules have in common: one request, its reply in common terms. All else is `api`'s."""

import base64
import logging
from types import ModuleType
from typing import Any, Protocol

from torc.errors import MissingDependencyError, extra_remedy
from torc.vlm.config import VlmConfig
from torc.vlm.protocol import Question, Reply

NO_KEY = "no-key"
"""Sent to servers that need no key: without one the vendors' libraries look for one in the environment."""


class Wire(Protocol):
    """An open connection to one vendor's kind of server."""

    def send(self, question: Question) -> Reply:
        """One request, no retries; the reply as the server gave it. Raises whatever the vendor's library raises."""
        ...

    def close(self) -> None:
        """Ends what is in flight."""
        ...


def missing(extra: str) -> MissingDependencyError:
    """The error of a vendor's library that is not installed."""
    return MissingDependencyError(f"The library for {extra} models", extra_remedy(extra))


def client_arguments(library: ModuleType, config: VlmConfig, key: str | None) -> dict[str, Any]:
    """How a client of OpenAI's or Anthropic's library is made: no retries, no redirects, no logging of requests."""
    # At level DEBUG it logs whole requests, images included.
    logging.getLogger(library.__name__).setLevel(logging.WARNING)
    return {
        "api_key": key or NO_KEY,
        "base_url": config.url,
        "timeout": config.timeout_s,
        "max_retries": 0,
        # A redirected request would carry key and images to wherever it leads.
        "http_client": library.DefaultHttpxClient(follow_redirects=False),
    }


def base64_text(png: bytes) -> str:
    """An image as JSON holds it."""
    return base64.b64encode(png).decode()


def count(record: Any, *path: str) -> int | None:
    """A number of tokens somewhere in a server's record; None where it does not tell."""
    for name in path:
        record = getattr(record, name, None)
    return record if isinstance(record, int) else None
