"""OpenAI, and every server that speaks its chat completions: vLLM, Ollama, llama-server, LM Studio and others."""

from typing import Any

from torc.vlm.clients.twins import base64_text, client_arguments, reply_of
from torc.vlm.clients.wire import WireReply, count, finished, missing
from torc.vlm.config import PROVIDERS, VlmConfig
from torc.vlm.failures import FailureKind, SendFailure
from torc.vlm.protocol import Finish, Question, Tokens

_FINISHES = {"length": Finish.TRUNCATED, "content_filter": Finish.REFUSED}
_THINKING_FIELDS = ("reasoning_content", "reasoning", "thinking")


class OpenAiWire:
    """One client of the openai library."""

    def __init__(self, config: VlmConfig, key: str | None) -> None:
        try:
            import openai
        except ImportError as error:
            raise missing("openai") from error
        # Empty, so that the environment's are not sent to somebody's own server.
        account = None if config.base_url is None else ""
        self._library, self._config = openai, config
        self._client = openai.OpenAI(
            organization=account, project=account, **client_arguments(openai, config, key)
        )

    def send(self, question: Question) -> WireReply:
        """One request. Raises SendFailure."""
        arguments = self._arguments(question)
        return reply_of(self._library, lambda: self._client.chat.completions.create(**arguments), _read)

    def close(self) -> None:
        """Ends what is in flight."""
        self._client.close()

    def _arguments(self, question: Question) -> dict[str, Any]:
        c = self._config
        content: list[dict[str, Any]] = [
            {
                "type": "image_url",
                "image_url": {"url": "data:image/png;base64," + base64_text(png)},
            }
            for png in question.images
        ]
        content.append({"type": "text", "text": question.prompt})
        arguments: dict[str, Any] = {"model": c.model, "messages": [{"role": "user", "content": content}]}
        if c.temperature is not None:
            arguments["temperature"] = c.temperature
        if c.max_output_tokens is not None:
            # OpenAI's thinking models take no other name; most other servers know the older one only.
            own = c.url == PROVIDERS["openai"]
            arguments["max_completion_tokens" if own else "max_tokens"] = c.max_output_tokens
        if c.seeded:
            arguments["seed"] = question.repeat
        if c.thinking is not None:
            arguments["reasoning_effort"] = "none" if c.thinking == "off" else c.thinking
        if c.structured and question.schema is not None:
            form = {"name": "answer", "strict": True, "schema": dict(question.schema)}
            arguments["response_format"] = {"type": "json_schema", "json_schema": form}
        return arguments


def _read(completion: Any) -> WireReply:
    """The library builds its records from whatever JSON arrives, so nothing in them is sure."""
    choices = getattr(completion, "choices", None)
    choice = choices[0] if isinstance(choices, list) and choices else None
    message = getattr(choice, "message", None)
    if message is None:
        raise SendFailure(FailureKind.BAD_RESPONSE, "no choices in it")
    usage = getattr(completion, "usage", None)
    thinking = getattr(getattr(usage, "completion_tokens_details", None), "reasoning_tokens", None)
    tokens = Tokens(
        count(getattr(usage, "prompt_tokens", None)),
        count(getattr(usage, "completion_tokens", None)),
        count(thinking),
    )
    version = str(getattr(completion, "model", None) or "")
    refusal = getattr(message, "refusal", None)
    if isinstance(refusal, str) and refusal:
        return WireReply(refusal, Finish.REFUSED, version, tokens)
    text = _text(message)
    finish = _FINISHES.get(str(getattr(choice, "finish_reason", None)), Finish.COMPLETE)
    return WireReply(text, finished(finish, text), version, tokens)


def _text(message: Any) -> str:
    """The content; some servers put a thinking model's whole answer into a field for thoughts and leave it empty."""
    content = getattr(message, "content", None)
    if isinstance(content, list):
        content = "".join(str(p.get("text", "")) for p in content if isinstance(p, dict))
    if isinstance(content, str) and content.strip():
        return content
    thoughts = (getattr(message, name, None) for name in _THINKING_FIELDS)
    return next((t for t in thoughts if isinstance(t, str) and t.strip()), "")
