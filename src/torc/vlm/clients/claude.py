"""Anthropic's Claude, over its own library: the vendor's OpenAI-compatible layer ignores schemas."""

from typing import Any

from torc.vlm.clients.wire import base64_text, client_arguments, count, missing
from torc.vlm.config import VlmConfig
from torc.vlm.protocol import Finish, Question, Reply, Tokens
from torc.vlm.replies import reply_of

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
        self._config = config
        self._client = anthropic.Anthropic(**client_arguments(anthropic, config, key))

    def send(self, question: Question) -> Reply:
        """One request."""
        return _read(self._client.messages.create(**self._arguments(question)))

    def close(self) -> None:
        """Ends what is in flight."""
        self._client.close()

    def _arguments(self, question: Question) -> dict[str, Any]:
        c = self._config
        source = {"type": "base64", "media_type": "image/png"}
        content: list[dict[str, Any]] = [
            {"type": "image", "source": source | {"data": base64_text(png)}} for png in question.images
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


def _read(message: Any) -> Reply:
    text = "".join(block.text for block in message.content if block.type == "text")
    tokens = Tokens(
        count(message.usage, "input_tokens"),
        count(message.usage, "output_tokens"),
        count(message.usage, "output_tokens_details", "thinking_tokens"),
    )
    finish = _FINISHES.get(message.stop_reason, Finish.COMPLETE)
    return reply_of(text, message.model or "", finish, tokens)
