"""Anthropic's Claude, over its own library: the vendor's OpenAI-compatible layer ignores schemas."""

from typing import Any

from torc.vlm.clients.twins import base64_text, client_arguments, reply_of
from torc.vlm.clients.wire import WireReply, count, finished, missing
from torc.vlm.config import VlmConfig
from torc.vlm.failures import FailureKind, SendFailure
from torc.vlm.protocol import Finish, Question, Tokens

_DEFAULT_MAX_TOKENS = 16_384
"""The service demands a bound."""
_FINISHES = {
    "max_tokens": Finish.TRUNCATED,
    "model_context_window_exceeded": Finish.TRUNCATED,
    "refusal": Finish.REFUSED,
}


class AnthropicWire:
    """One client of the anthropic library."""

    def __init__(self, config: VlmConfig, key: str | None) -> None:
        try:
            import anthropic
        except ImportError as error:
            raise missing("anthropic") from error
        self._library, self._config = anthropic, config
        self._client = anthropic.Anthropic(**client_arguments(anthropic, config, key))

    def send(self, question: Question) -> WireReply:
        """One request. Raises SendFailure."""
        arguments = self._arguments(question)
        return reply_of(self._library, lambda: self._client.messages.create(**arguments), _read)

    def close(self) -> None:
        """Ends what is in flight."""
        self._client.close()

    def _arguments(self, question: Question) -> dict[str, Any]:
        c = self._config
        content: list[dict[str, Any]] = [
            {
                "type": "image",
                "source": {
                    "type": "base64",
                    "media_type": "image/png",
                    "data": base64_text(png),
                },
            }
            for png in question.images
        ]
        content.append({"type": "text", "text": question.prompt})
        output: dict[str, Any] = {}
        arguments: dict[str, Any] = {
            "model": c.model,
            "max_tokens": c.max_output_tokens or _DEFAULT_MAX_TOKENS,
            "messages": [{"role": "user", "content": content}],
        }
        if c.temperature is not None:
            # The library no longer names it, since newer models take none; the service says so of those.
            arguments["extra_body"] = {"temperature": c.temperature}
        if c.thinking == "off" or c.thinking == 0:
            arguments["thinking"] = {"type": "disabled"}
        elif isinstance(c.thinking, int):
            arguments["thinking"] = {"type": "enabled", "budget_tokens": c.thinking}
        elif c.thinking is not None:
            arguments["thinking"] = {"type": "adaptive"}
            output["effort"] = "low" if c.thinking == "minimal" else c.thinking
        if c.structured and question.schema is not None:
            output["format"] = {"type": "json_schema", "schema": dict(question.schema)}
        if output:
            arguments["output_config"] = output
        return arguments


def _read(message: Any) -> WireReply:
    """The library builds its records from whatever JSON arrives, so nothing in them is sure."""
    content = getattr(message, "content", None)
    if not isinstance(content, list):
        raise SendFailure(FailureKind.BAD_RESPONSE, "no content in it")
    pieces = [getattr(block, "text", None) for block in content if getattr(block, "type", None) == "text"]
    text = "".join(piece for piece in pieces if isinstance(piece, str))
    usage = getattr(message, "usage", None)
    details = getattr(usage, "output_tokens_details", None)
    tokens = Tokens(
        count(getattr(usage, "input_tokens", None)),
        count(getattr(usage, "output_tokens", None)),
        count(getattr(details, "thinking_tokens", None)),
    )
    finish = _FINISHES.get(str(getattr(message, "stop_reason", None)), Finish.COMPLETE)
    return WireReply(text, finished(finish, text), str(getattr(message, "model", None) or ""), tokens)
