"""OpenAI, and every server that speaks its chat completions: vLLM, Ollama, llama-server, LM Studio and others."""

from typing import Any

from torc.vlm.clients.wire import base64_text, client_arguments, count, missing
from torc.vlm.config import PROVIDERS, VlmConfig
from torc.vlm.protocol import Finish, Question, Reply, Tokens
from torc.vlm.replies import reply_of

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
        self._config = config
        self._client = openai.OpenAI(
            organization=account, project=account, **client_arguments(openai, config, key)
        )

    def send(self, question: Question) -> Reply:
        """One request."""
        return _read(self._client.chat.completions.create(**self._arguments(question)))

    def close(self) -> None:
        """Ends what is in flight."""
        self._client.close()

    def _arguments(self, question: Question) -> dict[str, Any]:
        c = self._config
        urls = ["data:image/png;base64," + base64_text(png) for png in question.images]
        content: list[dict[str, Any]] = [{"type": "image_url", "image_url": {"url": url}} for url in urls]
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


def _read(completion: Any) -> Reply:
    choice = completion.choices[0]
    tokens = Tokens(
        count(completion, "usage", "prompt_tokens"),
        count(completion, "usage", "completion_tokens"),
        count(completion, "usage", "completion_tokens_details", "reasoning_tokens"),
    )
    version = completion.model or ""
    refusal = getattr(choice.message, "refusal", None)
    if refusal:
        return reply_of(refusal, version, Finish.REFUSED, tokens)
    finish = _FINISHES.get(choice.finish_reason, Finish.COMPLETE)
    return reply_of(_text(choice.message), version, finish, tokens)


def _text(message: Any) -> str:
    """The content; some servers put a thinking model's whole answer into a field for thoughts and leave it empty."""
    content = message.content or ""
    if isinstance(content, list):
        content = "".join(str(p.get("text", "")) for p in content)
    if content.strip():
        return content
    return next((t for name in _THINKING_FIELDS if (t := getattr(message, name, None))), "")
