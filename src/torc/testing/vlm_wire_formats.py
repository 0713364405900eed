"""The wire formats of three kinds of VLM servers, as functions: what they read, reply, and report as errors.

Written after the vendors' public API references (Gemini generateContent v1beta, OpenAI chat completions, Anthropic
messages). For the fake servers of `torc.testing.vlm_server`; a real server is never imitated to anybody but a test.
"""

import base64
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

FAKE_MODEL = "fake-of-torc-testing"
"""The model version that all fake replies carry."""


@dataclass(frozen=True)
class Say:
    """The model replies.

    Attributes:
        text: what it writes.
        finish: "complete", "truncated", "refused" or "empty".
        thoughts: its thinking, where the format has a place for it.
    """

    text: str = ""
    finish: str = "complete"
    thoughts: str = ""


@dataclass(frozen=True)
class Fail:
    """The server reports an error.

    Attributes:
        status: HTTP status.
        message: its words.
        retry_after_s: the wait it asks for.
    """

    status: int
    message: str = "this fake server was told to fail"
    retry_after_s: float | None = None


@dataclass(frozen=True)
class Asked:
    """A request, as the server understands it.

    Attributes:
        model, prompt: as sent.
        images: the PNG files.
        key: the key that came with it.
        schema: the JSON schema that the answer is to have, or None.
        options: temperature, thinking and so on, under the vendor's names.
    """

    model: str
    prompt: str
    images: tuple[bytes, ...]
    key: str
    schema: Mapping[str, Any] | None
    options: Mapping[str, Any]


class WireFormat(Protocol):
    """One vendor's format. `read` raises LookupError, TypeError or ValueError for a request that breaks it."""

    base_path: str
    """What the client's base URL ends in."""

    def read(self, path: str, headers: Mapping[str, str], body: Any) -> Asked: ...

    def reply(self, say: Say) -> dict[str, Any]: ...

    def error(self, fail: Fail) -> tuple[dict[str, Any], dict[str, str]]:
        """Body and headers."""
        ...


class GeminiFormat:
    """Google's generateContent."""

    base_path = ""

    def read(self, path: str, headers: Mapping[str, str], body: Any) -> Asked:
        prefix, suffix = "/v1beta/models/", ":generateContent"
        if not path.startswith(prefix) or not path.endswith(suffix):
            raise LookupError(path)
        body = _camel_case(body)
        parts = [part for content in body["contents"] for part in content["parts"]]
        images = tuple(_decoded(p["inlineData"], "mimeType") for p in parts if "inlineData" in p)
        config = dict(body.get("generationConfig", {}))
        schema = config.pop("responseJsonSchema", None)
        if schema is not None and config["responseMimeType"] != "application/json":
            raise ValueError("a schema needs responseMimeType application/json")
        text = "".join(p["text"] for p in parts if "text" in p)
        model = path[len(prefix) : -len(suffix)]
        return Asked(model, text, images, headers["x-goog-api-key"], schema, config)

    def reply(self, say: Say) -> dict[str, Any]:
        usage = {
            "promptTokenCount": 300,
            "candidatesTokenCount": 20,
            "thoughtsTokenCount": 5,
            "totalTokenCount": 325,
        }
        head = {"usageMetadata": usage, "modelVersion": FAKE_MODEL}
        if say.finish == "refused":
            return {"promptFeedback": {"blockReason": "SAFETY"}, **head}
        if say.finish == "empty":
            return {
                "candidates": [{"content": {"role": "model"}, "finishReason": "STOP", "index": 0}],
                **head,
            }
        parts = ([{"text": say.thoughts, "thought": True}] if say.thoughts else []) + [{"text": say.text}]
        reason = {"complete": "STOP", "truncated": "MAX_TOKENS"}[say.finish]
        return {
            "candidates": [
                {"content": {"parts": parts, "role": "model"}, "finishReason": reason, "index": 0}
            ],
            **head,
        }

    def error(self, fail: Fail) -> tuple[dict[str, Any], dict[str, str]]:
        names = {
            400: "INVALID_ARGUMENT",
            403: "PERMISSION_DENIED",
            404: "NOT_FOUND",
            429: "RESOURCE_EXHAUSTED",
        }
        details = []
        if fail.retry_after_s is not None:
            kind = "type.googleapis.com/google.rpc.RetryInfo"
            details.append({"@type": kind, "retryDelay": f"{fail.retry_after_s:g}s"})
        if fail.status == 401:  # Google refuses a wrong key with an ordinary 400
            fail = Fail(400, fail.message)
            details.append({"@type": "type.googleapis.com/google.rpc.ErrorInfo", "reason": "API_KEY_INVALID"})
        status = names.get(fail.status, "UNAVAILABLE" if fail.status >= 500 else "UNKNOWN")
        error = {"code": fail.status, "message": fail.message, "status": status, "details": details}
        return {"error": error}, {}


class OpenAiFormat:
    """OpenAI's chat completions, with the two fields that compatible servers add."""

    base_path = "/v1"

    def read(self, path: str, headers: Mapping[str, str], body: Any) -> Asked:
        if path != "/v1/chat/completions":
            raise LookupError(path)
        (message,) = body["messages"]
        images, texts = [], []
        for part in message["content"]:
            if part["type"] == "image_url":
                kind, _, data = part["image_url"]["url"].partition(",")
                if kind != "data:image/png;base64":
                    raise ValueError(kind)
                images.append(base64.b64decode(data, validate=True))
            else:
                texts.append(part["text"])
        options = {k: v for k, v in body.items() if k not in ("messages", "model", "response_format")}
        form = body.get("response_format")
        schema = form["json_schema"]["schema"] if form is not None else None
        key = headers["authorization"].removeprefix("Bearer ")
        return Asked(body["model"], "".join(texts), tuple(images), key, schema, options)

    def reply(self, say: Say) -> dict[str, Any]:
        message: dict[str, Any] = {"role": "assistant", "content": say.text or None, "refusal": None}
        if say.thoughts:
            message["reasoning_content"] = say.thoughts
        if say.finish == "refused":
            message |= {"content": None, "refusal": say.text or "I cannot help with that."}
        reason = "length" if say.finish == "truncated" else "stop"
        usage = {
            "prompt_tokens": 300,
            "completion_tokens": 25,
            "total_tokens": 325,
            "completion_tokens_details": {"reasoning_tokens": 5},
        }
        choice = {"index": 0, "message": message, "finish_reason": reason, "logprobs": None}
        head = {"id": "chatcmpl-fake", "object": "chat.completion", "created": 0, "model": FAKE_MODEL}
        return {**head, "choices": [choice], "usage": usage}

    def error(self, fail: Fail) -> tuple[dict[str, Any], dict[str, str]]:
        kind = {401: "invalid_request_error", 429: "rate_limit_error"}.get(fail.status, "server_error")
        body = {"error": {"message": fail.message, "type": kind, "param": None, "code": None}}
        return body, _retry_after(fail)


class AnthropicFormat:
    """Anthropic's messages."""

    base_path = ""

    def read(self, path: str, headers: Mapping[str, str], body: Any) -> Asked:
        if path != "/v1/messages":
            raise LookupError(path)
        if not headers["anthropic-version"] or not isinstance(body["max_tokens"], int):
            raise ValueError("anthropic-version and max_tokens are required")
        (message,) = body["messages"]
        parts = message["content"]
        images = tuple(_decoded(p["source"], "media_type") for p in parts if p["type"] == "image")
        options = {k: v for k, v in body.items() if k not in ("messages", "model")}
        output = dict(options.get("output_config", {}))
        form = output.pop("format", None)
        text = "".join(p["text"] for p in parts if p["type"] == "text")
        schema = form["schema"] if form is not None else None
        # The service takes a key in either header; its library has changed from the first to the second.
        key = headers.get("x-api-key") or headers["authorization"].removeprefix("Bearer ")
        return Asked(body["model"], text, images, key, schema, options | output)

    def reply(self, say: Say) -> dict[str, Any]:
        content: list[dict[str, Any]] = []
        if say.thoughts:
            content.append({"type": "thinking", "thinking": say.thoughts, "signature": "fake"})
        if say.text and say.finish != "empty":
            content.append({"type": "text", "text": say.text})
        reasons = {"truncated": "max_tokens", "refused": "refusal"}
        usage = {"input_tokens": 300, "output_tokens": 25, "output_tokens_details": {"thinking_tokens": 5}}
        return {
            "id": "msg_fake",
            "type": "message",
            "role": "assistant",
            "model": FAKE_MODEL,
            "content": content,
            "stop_reason": reasons.get(say.finish, "end_turn"),
            "stop_sequence": None,
            "usage": usage,
        }

    def error(self, fail: Fail) -> tuple[dict[str, Any], dict[str, str]]:
        kinds = {401: "authentication_error", 429: "rate_limit_error", 529: "overloaded_error"}
        error = {"type": kinds.get(fail.status, "api_error"), "message": fail.message}
        return {"type": "error", "error": error}, _retry_after(fail)


FORMATS: Mapping[str, WireFormat] = {
    "gemini": GeminiFormat(),
    "openai": OpenAiFormat(),
    "anthropic": AnthropicFormat(),
}
"""Provider -> its format."""


def _camel_case(value: Any) -> Any:
    """Google's servers take both spellings of a name, and its library sends a mixture."""
    if isinstance(value, list):
        return [_camel_case(item) for item in value]
    if not isinstance(value, dict):
        return value
    named = {re.sub(r"_([a-z])", lambda m: m.group(1).upper(), k): v for k, v in value.items()}
    return {k: v if k == "responseJsonSchema" else _camel_case(v) for k, v in named.items()}


def _decoded(source: Mapping[str, str], type_key: str) -> bytes:
    if source[type_key] != "image/png":
        raise ValueError(source[type_key])
    # Google's library writes the URL-safe alphabet.
    return base64.b64decode(source["data"].replace("-", "+").replace("_", "/"), validate=True)


def _retry_after(fail: Fail) -> dict[str, str]:
    return {} if fail.retry_after_s is None else {"retry-after": f"{fail.retry_after_s:g}"}
