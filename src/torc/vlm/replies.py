"""Replies: making one of a text, and what a client, which may be anybody's, has to return."""

import json
import math
from collections.abc import Iterator
from typing import Any

from torc.errors import VlmClientError
from torc.plugins import blamed, kind_of_value
from torc.vlm.json_text import find_json
from torc.vlm.protocol import Finish, Question, Reply, Tokens, VlmClient

_HELP = "torc.testing.vlm_client_conformance checks a client against all rules (docs/vlm.md)."


def reply_of(
    text: str,
    model_version: str,
    finish: Finish = Finish.COMPLETE,
    tokens: Tokens | None = None,
    latency_s: float = 0.0,
) -> Reply:
    """A reply of a text, with the answer that is found in it; the rest as `Reply` has it."""
    return Reply(text, find_json(text), finish, model_version, tokens or Tokens(), latency_s)


def ask_client(client: VlmClient, question: Question) -> Reply:
    """The client's reply.

    Raises:
        VlmClientError: the client crashed, or what it returned is no reply that could be read and logged.
        TorcError: what the client raises of its own accord, e.g. VlmError.
    """
    what = f"VLM client {type(client).__name__}"
    with blamed(what, VlmClientError, _HELP):
        reply: Any = client.ask(question)
    for fault in reply_faults(reply):
        raise VlmClientError(f"{what} gave no valid reply: {fault}. {_HELP}")
    return reply


def reply_faults(reply: Any) -> Iterator[str]:
    """Why something is no reply."""
    if not isinstance(reply, Reply):
        yield f"ask() returned {kind_of_value(reply)}, not a torc.vlm.protocol.Reply"
        return
    for name, wanted in (("text", str), ("model_version", str), ("finish", Finish), ("tokens", Tokens)):
        value = getattr(reply, name)
        if not isinstance(value, wanted):
            yield f"{name} is {kind_of_value(value)}; it must be a {wanted.__name__}"
    seconds = reply.latency_s
    number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if not number or not math.isfinite(seconds) or seconds < 0:
        yield f"latency_s is {seconds!r}; it must be a number of seconds"
    counts = [getattr(reply.tokens, name, None) for name in ("prompt", "reply", "thinking")]
    if not all(n is None or (isinstance(n, int) and not isinstance(n, bool) and n >= 0) for n in counts):
        yield f"tokens are {counts}; each must be a whole number or None"
    try:
        json.dumps(reply.answer)
    except (TypeError, ValueError, RecursionError) as error:
        yield f"answer is not data of JSON ({error}); torc.vlm.replies.reply_of finds it in the text"
