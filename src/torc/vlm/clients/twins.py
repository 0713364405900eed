"""What the libraries of OpenAI and Anthropic have in common: one generator made both, down to the errors' names."""

import base64
import logging
from collections.abc import Callable
from types import ModuleType
from typing import Any

from torc.vlm.clients.wire import NO_KEY, WireReply, seconds_in
from torc.vlm.config import VlmConfig
from torc.vlm.failures import FailureKind, SendFailure, kind_of_status


def client_arguments(library: ModuleType, config: VlmConfig, key: str | None) -> dict[str, Any]:
    """How a client is made: no retries of its own, no redirects, no logging of requests."""
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


def reply_of(library: ModuleType, request: Callable[[], Any], read: Callable[[Any], WireReply]) -> WireReply:
    """What `read` makes of the response. Raises SendFailure for every error of the library, and of `read`."""
    try:
        return read(request())
    except library.APITimeoutError:
        raise SendFailure(FailureKind.TIMEOUT, "the server did not answer in time") from None
    except library.APIConnectionError as error:
        raise SendFailure(FailureKind.CONNECTION, f"{error.message} {error.__cause__ or ''}") from None
    except library.APIStatusError as error:
        raise _failure(error) from None
    except SendFailure:
        raise
    except Exception as error:  # whatever garbage makes of the library's parser
        raise SendFailure(FailureKind.BAD_RESPONSE, type(error).__name__) from None


def base64_text(png: bytes) -> str:
    """An image as both send it."""
    return base64.b64encode(png).decode()


def _failure(error: Any) -> SendFailure:
    detail = f"HTTP {error.status_code} {error.message}"
    if getattr(error, "code", None) == "insufficient_quota":  # OpenAI's 429 that no waiting mends
        return SendFailure(FailureKind.AUTH, detail)
    after_s = seconds_in(error.response.headers.get("retry-after"))
    return SendFailure(kind_of_status(error.status_code), detail, after_s)
