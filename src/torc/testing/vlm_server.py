"""Fake VLM servers on the loopback interface: they speak the vendors' wire formats and do what a test tells them.

Written after the public references of Gemini generateContent v1beta, OpenAI chat completions and Anthropic messages.
They say that they are fakes: in their `Server` header, and in the model version of every reply.
"""

import base64
import json
import re
import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

FAKE_MODEL = "fake-of-torc-testing"
"""The model version that all fake replies carry."""
BASE_PATHS = {"gemini": "", "openai": "/v1", "anthropic": ""}
"""What a client's base URL ends in."""
_Json = dict[str, Any]


@dataclass(frozen=True)
class Say:
    """The model replies.

    Attributes:
        text: what it writes.
        finish: "complete", "truncated", "refused" or "empty".
        thoughts: its thinking, where the format has a place for it.
        late_s: the reply comes after this time.
    """

    text: str = ""
    finish: str = "complete"
    thoughts: str = ""
    late_s: float = 0.0


@dataclass(frozen=True)
class Fail:
    """The server reports an error: HTTP status, its words, the wait that it asks for."""

    status: int
    message: str = "this fake server was told to fail"
    retry_after_s: float | None = None


@dataclass(frozen=True)
class Raw:
    """Any response."""

    body: bytes = b""
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=lambda: {"content-type": "application/json"})


class Broken(Enum):
    """A connection that ends without a reply, or one whose reply comes byte by byte and never ends."""

    HANG_UP = "hang up"
    DRIP = "drip"


Behavior = Say | Fail | Raw | Broken


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


class FakeVlmServer:
    """A fake server of one provider's kind; a context manager.

    Args:
        provider: "gemini", "openai" or "anthropic".
        script: what it does, request by request; the last repeats.
        key: refuses requests that bring another key; None takes any.

    Attributes:
        asked: the requests that kept to the format, in order.
        headers: of all requests.
    """

    def __init__(self, provider: str, script: Iterable[Behavior], key: str | None = None) -> None:
        self.provider, self.key = provider, key
        self.asked: list[Asked] = []
        self.headers: list[dict[str, str]] = []
        self.stopping = threading.Event()
        self._script, self._lock = list(script), threading.Lock()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.01})

    @property
    def url(self) -> str:
        """Base URL for a client."""
        return f"http://127.0.0.1:{self._server.server_port}{BASE_PATHS[self.provider]}"

    def __enter__(self) -> "FakeVlmServer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stopping.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()

    def behavior_for(self, path: str, headers: dict[str, str], body: bytes) -> Behavior:
        """Records a request; what it gets, an error for one that a real server would not take."""
        self.headers.append(headers)
        try:
            asked = _READERS[self.provider](path, headers, json.loads(body))
        except (LookupError, TypeError, ValueError) as error:
            return Fail(400, f"bad request: {type(error).__name__} {error}")
        if self.key is not None and asked.key != self.key:
            return Fail(401, f"Incorrect API key provided: {asked.key}")
        self.asked.append(asked)
        with self._lock:
            return self._script.pop(0) if len(self._script) > 1 else self._script[0]


def _handler(fake: FakeVlmServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        server_version = "torc.testing-fake-vlm"
        sys_version = ""

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers.get("content-length", 0)))
            headers = {name.lower(): value for name, value in self.headers.items()}
            try:
                self.behave(fake.behavior_for(self.path.partition("?")[0], headers, body))
            except OSError:  # the client went away
                self.close_connection = True

        def behave(self, behavior: Behavior) -> None:
            if isinstance(behavior, Raw):
                self.send(behavior)
            elif isinstance(behavior, Fail):
                self.send(_error(fake.provider, behavior))
            elif isinstance(behavior, Say):
                fake.stopping.wait(behavior.late_s)
                self.send(Raw(json.dumps(_REPLIES[fake.provider](behavior)).encode()))
            elif behavior is Broken.DRIP:
                self.send(Raw(b"{"), length=10**9)
                while not fake.stopping.is_set():
                    self.wfile.write(b" ")
                    time.sleep(0.02)
            else:
                self.close_connection = True

        def send(self, raw: Raw, length: int | None = None) -> None:
            self.send_response(raw.status)
            for name, value in raw.headers.items():
                self.send_header(name, value)
            self.send_header("content-length", str(len(raw.body) if length is None else length))
            self.end_headers()
            self.wfile.write(raw.body)

        def log_message(self, format: str, *arguments: Any) -> None:
            """Nothing on stderr."""

    return Handler


def _read_gemini(path: str, headers: Mapping[str, str], body: Any) -> Asked:
    model = re.fullmatch(r"/v1beta/models/(.+):generateContent", path)
    if model is None:
        raise LookupError(path)
    parts = [part for content in body["contents"] for part in content["parts"]]
    blobs = [p["inlineData"] for p in parts if "inlineData" in p]
    # Google's servers take both spellings of a name, and its library sends a mixture.
    images = tuple(_png(b.get("mimeType") or b["mime_type"], b["data"]) for b in blobs)
    options = dict(body.get("generationConfig", {}))
    schema = options.pop("responseJsonSchema", None)
    if schema is not None and options["responseMimeType"] != "application/json":
        raise ValueError("a schema needs responseMimeType application/json")
    text = "".join(p["text"] for p in parts if "text" in p)
    return Asked(model.group(1), text, images, headers["x-goog-api-key"], schema, options)


def _read_openai(path: str, headers: Mapping[str, str], body: Any) -> Asked:
    if path != "/v1/chat/completions":
        raise LookupError(path)
    (message,) = body["messages"]
    urls = [part["image_url"]["url"] for part in message["content"] if part["type"] == "image_url"]
    images = tuple(_png(*url.removeprefix("data:").split(";base64,")) for url in urls)
    text = "".join(part["text"] for part in message["content"] if part["type"] == "text")
    schema = body["response_format"]["json_schema"]["schema"] if "response_format" in body else None
    options = {k: v for k, v in body.items() if k not in ("messages", "model", "response_format")}
    return Asked(body["model"], text, images, _bearer(headers), schema, options)


def _read_anthropic(path: str, headers: Mapping[str, str], body: Any) -> Asked:
    if path != "/v1/messages":
        raise LookupError(path)
    if not headers["anthropic-version"] or not isinstance(body["max_tokens"], int):
        raise ValueError("anthropic-version and max_tokens are required")
    (message,) = body["messages"]
    sources = [p["source"] for p in message["content"] if p["type"] == "image"]
    images = tuple(_png(source["media_type"], source["data"]) for source in sources)
    text = "".join(p["text"] for p in message["content"] if p["type"] == "text")
    output = dict(body.get("output_config", {}))
    schema = output.pop("format", {}).get("schema")
    options = {k: v for k, v in body.items() if k not in ("messages", "model")} | output
    return Asked(body["model"], text, images, headers.get("x-api-key") or _bearer(headers), schema, options)


def _gemini_reply(say: Say) -> _Json:
    usage = {"promptTokenCount": 300, "candidatesTokenCount": 20, "thoughtsTokenCount": 5}
    head: _Json = {"usageMetadata": usage, "modelVersion": FAKE_MODEL}
    if say.finish == "refused":
        return head | {"promptFeedback": {"blockReason": "SAFETY"}}
    content: _Json = {"role": "model"}
    if say.finish != "empty":
        thoughts = [{"text": say.thoughts, "thought": True}] if say.thoughts else []
        content["parts"] = [*thoughts, {"text": say.text}]
    reason = "MAX_TOKENS" if say.finish == "truncated" else "STOP"
    return head | {"candidates": [{"content": content, "finishReason": reason, "index": 0}]}


def _openai_reply(say: Say) -> _Json:
    message: _Json = {"role": "assistant", "content": say.text or None, "refusal": None}
    if say.thoughts:
        message["reasoning_content"] = say.thoughts
    if say.finish == "refused":
        message |= {"content": None, "refusal": say.text or "I cannot help with that."}
    details = {"reasoning_tokens": 5}
    usage = {"prompt_tokens": 300, "completion_tokens": 25, "completion_tokens_details": details}
    reason = "length" if say.finish == "truncated" else "stop"
    choice = {"index": 0, "message": message, "finish_reason": reason, "logprobs": None}
    head = {"id": "chatcmpl-fake", "object": "chat.completion", "created": 0, "model": FAKE_MODEL}
    return head | {"choices": [choice], "usage": usage | {"total_tokens": 325}}


def _anthropic_reply(say: Say) -> _Json:
    thoughts = {"type": "thinking", "thinking": say.thoughts, "signature": "fake"}
    text = {"type": "text", "text": say.text}
    content = [thoughts] * bool(say.thoughts) + [text] * bool(say.text and say.finish != "empty")
    reason = {"truncated": "max_tokens", "refused": "refusal"}.get(say.finish, "end_turn")
    usage = {"input_tokens": 300, "output_tokens": 25, "output_tokens_details": {"thinking_tokens": 5}}
    head = {"id": "msg_fake", "type": "message", "role": "assistant", "model": FAKE_MODEL}
    return head | {"content": content, "stop_reason": reason, "stop_sequence": None, "usage": usage}


_READERS = {"gemini": _read_gemini, "openai": _read_openai, "anthropic": _read_anthropic}
_REPLIES = {"gemini": _gemini_reply, "openai": _openai_reply, "anthropic": _anthropic_reply}


def _error(provider: str, fail: Fail) -> Raw:
    headers = {"content-type": "application/json"}
    status, error = fail.status, {"message": fail.message, "type": "error"}
    wait = None if fail.retry_after_s is None else f"{fail.retry_after_s:g}"
    if provider != "gemini":
        headers |= {} if wait is None else {"retry-after": wait}
        return Raw(json.dumps({"type": "error", "error": error}).encode(), status, headers)
    details = [] if wait is None else [{"@type": "google.rpc.RetryInfo", "retryDelay": f"{wait}s"}]
    if status == 401:  # Google refuses a wrong key with an ordinary 400
        status, details = 400, [{"@type": "google.rpc.ErrorInfo", "reason": "API_KEY_INVALID"}]
    google = {"code": status, "message": fail.message, "status": "FAILED", "details": details}
    return Raw(json.dumps({"error": google}).encode(), status, headers)


def _png(kind: str, data: str) -> bytes:
    if kind != "image/png":
        raise ValueError(kind)
    # Google's library writes the URL-safe alphabet.
    return base64.b64decode(data.replace("-", "+").replace("_", "/"), validate=True)


def _bearer(headers: Mapping[str, str]) -> str:
    return headers["authorization"].removeprefix("Bearer ")
