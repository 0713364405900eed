"""The vendors' protocols: the request for a question, and the reply in common terms. `api` does everything else."""

import base64
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from torc.io.pictures import data_url, media_type
from torc.records.evidence import Tokens
from torc.vlm.config import PROVIDERS, VlmConfig
from torc.vlm.protocol import Finish, Question, Reply
from torc.vlm.replies import reply_of

_GEMINI_REFUSALS = (
    "SAFETY",
    "RECITATION",
    "LANGUAGE",
    "BLOCKLIST",
    "PROHIBITED_CONTENT",
    "SPII",
    "IMAGE_SAFETY",
    "IMAGE_PROHIBITED_CONTENT",
    "ESCALATION",
    "MODEL_ARMOR",
)
_FINISHES = {
    **dict.fromkeys(("MAX_TOKENS", "CONTINUATION"), Finish.TRUNCATED),
    **dict.fromkeys(_GEMINI_REFUSALS, Finish.REFUSED),
    **dict.fromkeys(("max_tokens", "model_context_window_exceeded"), Finish.TRUNCATED),
    "refusal": Finish.REFUSED,
    "length": Finish.TRUNCATED,
    "content_filter": Finish.REFUSED,
}
"""Meaning of the vendors' finish reasons other than an ordinary end."""
_ANTHROPIC_MAX_TOKENS = 16_384
"""The service requires a bound."""
_THINKING_FIELDS = ("reasoning_content", "reasoning", "thinking")


Post = tuple[str, dict[str, str], dict[str, Any]]
"""A request: the path after the server's address, the headers, the body as plain data."""


class Vendor(NamedTuple):
    """A vendor's protocol. `read` raises LookupError, TypeError, ValueError or AttributeError for malformed answers."""

    post: Callable[[VlmConfig, Question, str | None], Post]
    read: Callable[[Any], Reply]


def _post_gemini(c: VlmConfig, question: Question, key: str | None) -> Post:
    parts: list[Any] = [
        {"inlineData": {"mimeType": media_type(p), "data": _base64(p)}} for p in question.images
    ]
    options: dict[str, Any] = {"temperature": c.temperature, "maxOutputTokens": c.max_output_tokens}
    options["seed"] = question.repeat if c.seeded else None
    if c.structured and question.schema is not None:
        options |= {"responseMimeType": "application/json", "responseJsonSchema": dict(question.schema)}
    if c.thinking is not None:
        budget = 0 if c.thinking == "off" else c.thinking
        words = isinstance(budget, str)
        options["thinkingConfig"] = (
            {"thinkingLevel": str(budget).upper()} if words else {"thinkingBudget": budget}
        )
    turns = [(role, [{"text": text}]) for role, text in _turns(question, "model")]
    turns.append(("user", [*parts, {"text": question.prompt}]))
    # Preview models, Robotics-ER (the paper's) among them, exist only in v1beta.
    path = f"/v1beta/models/{c.model}:generateContent"
    body = {
        "systemInstruction": {"parts": [{"text": question.system}]} if question.system else None,
        "contents": [{"role": role, "parts": content} for role, content in turns],
        "generationConfig": _given(options),
    }
    return path, _given({"x-goog-api-key": key}), _given(body)


def _read_gemini(answer: Any) -> Reply:
    """Read a reply; blocked prompts, cut-off and empty replies all arrive as ordinary responses."""
    names = ("promptTokenCount", "candidatesTokenCount", "thoughtsTokenCount")
    sent, said, thought = (_count(answer, "usageMetadata", name) for name in names)
    # Only Google counts thinking separately; a model that does not think has no such count.
    tokens = Tokens(sent, None if said is None and thought is None else (said or 0) + (thought or 0), thought)
    version, feedback = answer.get("modelVersion") or "", answer.get("promptFeedback")
    if not answer.get("candidates"):
        if feedback is None and "usageMetadata" not in answer:
            raise ValueError("no candidates, no usage")
        return reply_of("", version, Finish.REFUSED if feedback else Finish.EMPTY, tokens)
    candidate = answer["candidates"][0]
    parts = candidate.get("content", {}).get("parts", [])
    text = "".join(part.get("text", "") for part in parts if not part.get("thought"))
    return reply_of(text, version, _FINISHES.get(candidate.get("finishReason"), Finish.COMPLETE), tokens)


def _post_openai(c: VlmConfig, question: Question, key: str | None) -> Post:
    content: list[dict[str, Any]] = [
        {"type": "image_url", "image_url": {"url": data_url(picture)}} for picture in question.images
    ]
    content.append({"type": "text", "text": question.prompt})
    messages: list[dict[str, Any]] = (
        [{"role": "system", "content": question.system}] if question.system else []
    )
    messages += ({"role": role, "content": text} for role, text in _turns(question, "assistant"))
    messages.append({"role": "user", "content": content})
    # OpenAI's thinking models accept only this name for the bound; most other servers know only the older one.
    bound = "max_completion_tokens" if c.url == PROVIDERS["openai"] else "max_tokens"
    body: dict[str, Any] = {
        "model": c.model,
        "messages": messages,
        "temperature": c.temperature,
        bound: c.max_output_tokens,
        "seed": question.repeat if c.seeded else None,
        "reasoning_effort": "none" if c.thinking == "off" else c.thinking,
    }
    if c.structured and question.schema is not None:
        form = {"name": "answer", "strict": True, "schema": dict(question.schema)}
        body["response_format"] = {"type": "json_schema", "json_schema": form}
    return "/chat/completions", {"authorization": f"Bearer {key}"} if key else {}, _given(body)


def _read_openai(answer: Any) -> Reply:
    choice = answer["choices"][0]
    message, version = choice["message"], answer.get("model") or ""
    tokens = Tokens(
        _count(answer, "usage", "prompt_tokens"),
        _count(answer, "usage", "completion_tokens"),
        _count(answer, "usage", "completion_tokens_details", "reasoning_tokens"),
    )
    if message.get("refusal"):
        return reply_of(message["refusal"], version, Finish.REFUSED, tokens)
    text = message.get("content") or ""
    if isinstance(text, list):
        text = "".join(str(part.get("text", "")) for part in text)
    if not text.strip():  # some servers put a thinking model's whole answer into a field for thoughts
        text = next((message[name] for name in _THINKING_FIELDS if message.get(name)), "")
    return reply_of(text, version, _FINISHES.get(choice.get("finish_reason"), Finish.COMPLETE), tokens)


def _post_anthropic(c: VlmConfig, question: Question, key: str | None) -> Post:
    """Return the request in Claude's own protocol: the vendor's OpenAI-compatible layer ignores schemas."""
    sources = [{"type": "base64", "media_type": media_type(p), "data": _base64(p)} for p in question.images]
    content: list[dict[str, Any]] = [{"type": "image", "source": source} for source in sources]
    content.append({"type": "text", "text": question.prompt})
    messages: list[dict[str, Any]] = [{"role": r, "content": t} for r, t in _turns(question, "assistant")]
    body: dict[str, Any] = {
        "model": c.model,
        "max_tokens": c.max_output_tokens or _ANTHROPIC_MAX_TOKENS,
        "system": question.system or None,
        "messages": [*messages, {"role": "user", "content": content}],
        "temperature": c.temperature,
    }
    output: dict[str, Any] = {}
    if c.thinking == "off" or c.thinking == 0:
        body["thinking"] = {"type": "disabled"}
    elif isinstance(c.thinking, int):
        body["thinking"] = {"type": "enabled", "budget_tokens": c.thinking}
    elif c.thinking is not None:
        body["thinking"] = {"type": "adaptive"}
        output["effort"] = "low" if c.thinking == "minimal" else c.thinking
    if c.structured and question.schema is not None:
        output["format"] = {"type": "json_schema", "schema": dict(question.schema)}
    headers = {"anthropic-version": "2023-06-01", "x-api-key": key}
    return "/v1/messages", _given(headers), _given({**body, "output_config": output or None})


def _read_anthropic(answer: Any) -> Reply:
    text = "".join(block["text"] for block in answer["content"] if block["type"] == "text")
    tokens = Tokens(
        _count(answer, "usage", "input_tokens"),
        _count(answer, "usage", "output_tokens"),
        _count(answer, "usage", "output_tokens_details", "thinking_tokens"),
    )
    return reply_of(
        text, answer.get("model") or "", _FINISHES.get(answer.get("stop_reason"), Finish.COMPLETE), tokens
    )


VENDORS: Mapping[str, Vendor] = MappingProxyType(
    {
        "gemini": Vendor(_post_gemini, _read_gemini),
        "openai": Vendor(_post_openai, _read_openai),
        "anthropic": Vendor(_post_anthropic, _read_anthropic),
    }
)


def _turns(question: Question, model: str) -> list[tuple[str, str]]:
    """Return role and text of the turns before the question; `model` is the vendor's word for who replies."""
    return [turn for e in question.examples for turn in (("user", e.user), (model, e.reply))]


def _given(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that are not None."""
    return {name: value for name, value in options.items() if value is not None}


def _base64(picture: bytes) -> str:
    return base64.b64encode(picture).decode()


def _count(record: Any, *path: str) -> int | None:
    """Return a number of tokens from a server's record; None if it is not reported."""
    for name in path:
        record = record.get(name) if isinstance(record, dict) else None
    return record if isinstance(record, int) else None
