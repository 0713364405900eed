"""Replies: the JSON in a text, and checks of what a client returns."""

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from torc.errors import VlmClientError
from torc.records.evidence import Tokens
from torc.registry.loading import blamed, kind_of_value
from torc.vlm.protocol import Finish, Question, Reply, VlmClient

_HELP = "torc.testing.vlm_client_conformance checks a client against all rules (docs/vlm.md)."

MAX_CHARACTERS = 50_000
"""Only the last characters of a reply are read: an answer stands at the end."""
_MAX_TRIES = 500
_OPENING = re.compile(r"[\[{]")
_DECODER = json.JSONDecoder()
_TRAILING = re.compile(r"(?<![\[{,]),\s*[\]}]")
_STRING_OR_TRAILING = re.compile(r'"(?:[^"\\]|\\.)*"|(?<![\[{,]),(?=\s*[\]}])', re.DOTALL)


def reply_of(
    text: str,
    model_version: str,
    finish: Finish = Finish.COMPLETE,
    tokens: Tokens | None = None,
    latency_s: float = 0.0,
) -> Reply:
    """Make a Reply from a text, with the answer that is found in it."""
    return Reply(text, find_json(text), finish, model_version, tokens or Tokens(), latency_s)


def ask_client(client: VlmClient, question: Question) -> Reply:
    """Return the client's reply.

    Raises:
        VlmClientError: the client crashed, or returned something that cannot be read and logged.
        TorcError: the client raised it deliberately, e.g. VlmError.
    """
    what = f"VLM client {type(client).__name__}"
    with blamed(what, VlmClientError, _HELP):
        reply: Any = client.ask(question)
    for fault in reply_faults(reply):
        raise VlmClientError(f"{what} gave no valid reply: {fault}. {_HELP}")
    return reply


def reply_faults(reply: Any) -> Iterator[str]:
    """Yield the reasons why something is not a valid reply."""
    if not isinstance(reply, Reply):
        yield f"ask() returned {kind_of_value(reply)}, not a torc.vlm.protocol.Reply"
        return
    for name, wanted in (("text", str), ("model_version", str), ("finish", Finish), ("tokens", Tokens)):
        value = getattr(reply, name)
        if not isinstance(value, wanted):
            yield f"{name} is {kind_of_value(value)}; it must be a {wanted.__name__}"
    seconds = reply.latency_s
    if type(seconds) not in (int, float) or not 0 <= seconds < math.inf:
        yield f"latency_s is {seconds!r}; it must be a number of seconds"
    counts = [getattr(reply.tokens, name, None) for name in ("prompt", "reply", "thinking")]
    if not all(n is None or (type(n) is int and n >= 0) for n in counts):
        yield f"tokens are {counts}; each must be a whole number or None"
    try:
        json.dumps(reply.answer)
    except (TypeError, ValueError, RecursionError) as error:
        yield f"answer is not data of JSON ({error}); torc.vlm.replies.reply_of finds it in the text"


def find_json(text: str) -> Any:
    """Return the JSON object or array in a text that is most likely its answer, or None. Raises nothing.

    JSON in ``` fences takes precedence, then JSON that holds an object over bare lists such as "[1]", then the last,
    since models repeat the question's form first. A comma before a closing bracket is ignored.
    """
    text = text[-MAX_CHARACTERS:]
    fenced = [value for part in text.split("```")[1::2] for value in _values(part)]
    values = fenced or _values(text)
    objects = [v for v in values if isinstance(v, dict) or any(isinstance(item, dict) for item in v)]
    return (objects or values or [None])[-1]


def _values(text: str) -> list[Any]:
    """Return the outermost objects and arrays, in order; of very many brackets only the last are tried."""
    found, end = [], 0
    trailing = _TRAILING.search(text) is not None
    for start in [opening.start() for opening in _OPENING.finditer(text)][-_MAX_TRIES:]:
        if start < end:
            continue
        decoded = _decoded(text, start) or (trailing and _decoded(_without_trailing(text, start), start))
        if decoded:
            value, end = decoded
            found.append(value)
    return found


def _decoded(text: str, start: int) -> tuple[Any, int] | None:
    """Return the JSON that begins at a place, and where it ends; None if it is not JSON, or nested too deeply."""
    try:
        return _DECODER.raw_decode(text, start)
    except (ValueError, RecursionError):
        return None


def _without_trailing(text: str, start: int) -> str:
    """Replace commas before closing brackets by blanks, from a place on, but not in strings."""
    blanked = _STRING_OR_TRAILING.sub(lambda m: " " if m.group() == "," else m.group(), text[start:])
    return text[:start] + blanked
