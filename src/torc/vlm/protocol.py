"""The question to a vision-language model, its reply, and the protocol of clients."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

from torc.records.evidence import Tokens
from torc.vlm.prompt import Example


@dataclass(frozen=True)
class Question:
    """One prompt with its images. A model is given no tools: its answer is only read.

    Attributes:
        prompt: the text; it follows the images.
        images: PNG or JPEG files.
        schema: JSON schema of the answer, for servers that can hold a model to one; None for free text.
        repeat: distinguishes repetitions of one question: part of the cache's key, and the sampling seed where the
            configuration says so. At least 0, below 2**31.
        system: instructions before the conversation; may be empty.
        examples: turns of a conversation before the question.
    """

    prompt: str
    images: tuple[bytes, ...] = field(default=(), repr=False)
    schema: Mapping[str, Any] | None = None
    repeat: int = 0
    system: str = ""
    examples: tuple[Example, ...] = ()


class Finish(StrEnum):
    """How a reply ended."""

    COMPLETE = "complete"
    TRUNCATED = "truncated"
    REFUSED = "refused"
    EMPTY = "empty"


@dataclass(frozen=True)
class Reply:
    """A model's reply, however useless. A server that does not reply is a VlmError instead.

    Attributes:
        text: what it wrote, without its hidden thinking.
        answer: the JSON object or array in the text that is taken as the answer; None if there is none.
        finish: how the reply ended.
        model_version: the model that answered, as the server names it.
        tokens: tokens sent and written.
        latency_s: from the last request to the reply, seconds, without waits between tries.
    """

    text: str
    answer: Any
    finish: Finish
    model_version: str
    tokens: Tokens
    latency_s: float


@runtime_checkable
class VlmClient(Protocol):
    """Asks one model. `torc.testing.vlm_client_conformance` checks an implementation."""

    def ask(self, question: Question) -> Reply:
        """Return the model's reply. Raises VlmError if the server gives none."""
        ...
