"""Fake VLM servers on the loopback interface: they speak the vendors' wire formats and do what a test tells them.

Written after the public references of Gemini generateContent v1beta, OpenAI chat completions and Anthropic messages.
"""

import base64
import json
import re
import threading
import time
from collections.abc import Iterable, Mapping
from enum import Enum
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, NamedTuple

FAKE_MODEL = "fake-of-torc-testing"
"""The model version that all fake replies carry."""


class Say(NamedTuple):
    """The model replies after `late_s` seconds, maybe with its thinking before it."""

    text: str = ""
    finish: str = "complete"
    thoughts: str = ""
    late_s: float = 0.0


class Fail(NamedTuple):
    """The server reports an error."""

    status: int
    message: str = "this fake server was told to fail"
    retry_after_s: float | None = None


class Raw(NamedTuple):
    """Any response."""

    body: bytes = b""
    status: int = 200
    headers: Mapping[str, str] = {"content-type": "application/json"}


class Broken(Enum):
    """A connection that ends without a reply, or one whose reply comes byte by byte and never ends."""

    HANG_UP = "hang up"
    DRIP = "drip"


Behavior = Say | Fail | Raw | Broken


class Asked(NamedTuple):
    """A request, as the server understands it."""

    model: str
    prompt: str
    images: tuple[bytes, ...]
    key: str
    schema: Mapping[str, Any] | None
    options: Mapping[str, Any]
    system: str = ""
    turns: tuple[tuple[str, str], ...] = ()
    """Role and text of what came before the question, the model's role as "model"."""


class FakeVlmServer:
    """A fake server of one provider's kind, in a `with`; it goes through the script and repeats its last entry.

    `asked` are the requests that kept to the format, `headers` those of all requests. With a key it refuses others.
    """

    def __init__(self, provider: str, script: Iterable[Behavior], key: str | None = None) -> None:
        self.provider, self.key, self.script = provider, key, list(script)
        self.asked: list[Asked] = []
        self.headers: list[dict[str, str]] = []
        self.stopping = threading.Event()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.01})

    @property
    def url(self) -> str:
        """Base URL for a client."""
        return f"http://127.0.0.1:{self._server.server_port}{'/v1' if self.provider == 'openai' else ''}"

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
        return self.script.pop(0) if len(self.script) > 1 else self.script[0]


def _handler(fake: FakeVlmServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

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
    *before, last = body["contents"]
    turns = _turns((c["role"], c["parts"]) for c in before)
    if last["role"] != "user":
        raise ValueError(last["role"])
    parts = last["parts"]
    system = "".join(p["text"] for p in body.get("systemInstruction", {"parts": []})["parts"])
    blobs = [p["inlineData"] for p in parts if "inlineData" in p]
    images = tuple(_picture(b["mimeType"], b["data"]) for b in blobs)
    options = dict(body.get("generationConfig", {}))
    schema = options.pop("responseJsonSchema", None)
    if schema is not None and options["responseMimeType"] != "application/json":
        raise ValueError("a schema needs responseMimeType application/json")
    text = "".join(p["text"] for p in parts if "text" in p)
    return Asked(
        model.group(1), text, images, headers.get("x-goog-api-key", ""), schema, options, system, turns
    )


def _read_openai(path: str, headers: Mapping[str, str], body: Any) -> Asked:
    if path != "/v1/chat/completions":
        raise LookupError(path)
    *before, message = body["messages"]
    system = "".join(m["content"] for m in before if m["role"] == "system")
    turns = _turns((m["role"], [{"text": m["content"]}]) for m in before if m["role"] != "system")
    urls = [part["image_url"]["url"] for part in message["content"] if part["type"] == "image_url"]
    images = tuple(_picture(*url.removeprefix("data:").split(";base64,")) for url in urls)
    text = "".join(part["text"] for part in message["content"] if part["type"] == "text")
    schema = body["response_format"]["json_schema"]["schema"] if "response_format" in body else None
    options = {k: v for k, v in body.items() if k not in ("messages", "model", "response_format")}
    return Asked(body["model"], text, images, _bearer(headers), schema, options, system, turns)


def _read_anthropic(path: str, headers: Mapping[str, str], body: Any) -> Asked:
    if path != "/v1/messages":
        raise LookupError(path)
    if not headers["anthropic-version"] or not isinstance(body["max_tokens"], int):
        raise ValueError("anthropic-version and max_tokens are required")
    *before, message = body["messages"]
    turns = _turns((m["role"], [{"text": m["content"]}]) for m in before)
    sources = [p["source"] for p in message["content"] if p["type"] == "image"]
    images = tuple(_picture(source["media_type"], source["data"]) for source in sources)
    text = "".join(p["text"] for p in message["content"] if p["type"] == "text")
    output = dict(body.get("output_config", {}))
    schema = output.pop("format", {}).get("schema")
    options = {k: v for k, v in body.items() if k not in ("messages", "model", "system")} | output
    key, system = headers.get("x-api-key") or _bearer(headers), body.get("system", "")
    return Asked(body["model"], text, images, key, schema, options, system, turns)


def _turns(found: Iterable[tuple[str, Any]]) -> tuple[tuple[str, str], ...]:
    """Turns of user and model, one after the other, as all three vendors want them."""
    names = {"assistant": "model", "model": "model", "user": "user"}
    turns = tuple((names[role], "".join(p["text"] for p in parts)) for role, parts in found)
    if [role for role, _ in turns] != ["user", "model"] * (len(turns) // 2):
        raise ValueError(f"turns of {[role for role, _ in turns]}")
    return turns


def _gemini_reply(say: Say) -> dict[str, Any]:
    usage = {"promptTokenCount": 300, "candidatesTokenCount": 20, "thoughtsTokenCount": 5}
    head: dict[str, Any] = {"usageMetadata": usage, "modelVersion": FAKE_MODEL}
    if say.finish == "refused":
        return head | {"promptFeedback": {"blockReason": "SAFETY"}}
    thoughts = [{"text": say.thoughts, "thought": True}] if say.thoughts else []
    content = {} if say.finish == "empty" else {"parts": [*thoughts, {"text": say.text}]}
    reason = "MAX_TOKENS" if say.finish == "truncated" else "STOP"
    return head | {"candidates": [{"content": content, "finishReason": reason}]}


def _openai_reply(say: Say) -> dict[str, Any]:
    message = {"content": say.text or None, "reasoning_content": say.thoughts}
    if say.finish == "refused":
        message = {"content": None, "refusal": say.text or "I cannot help with that."}
    details = {"reasoning_tokens": 5}
    usage = {"prompt_tokens": 300, "completion_tokens": 25, "completion_tokens_details": details}
    reason = "length" if say.finish == "truncated" else "stop"
    return {"model": FAKE_MODEL, "choices": [{"message": message, "finish_reason": reason}], "usage": usage}


def _anthropic_reply(say: Say) -> dict[str, Any]:
    text = [{"type": "text", "text": say.text}] if say.text and say.finish != "empty" else []
    content = [{"type": "thinking", "thinking": say.thoughts}, *text]
    reason = {"truncated": "max_tokens", "refused": "refusal"}.get(say.finish, "end_turn")
    usage = {"input_tokens": 300, "output_tokens": 25, "output_tokens_details": {"thinking_tokens": 5}}
    return {"model": FAKE_MODEL, "content": content, "stop_reason": reason, "usage": usage}


_READERS = {"gemini": _read_gemini, "openai": _read_openai, "anthropic": _read_anthropic}
_REPLIES = {"gemini": _gemini_reply, "openai": _openai_reply, "anthropic": _anthropic_reply}


def _error(provider: str, fail: Fail) -> Raw:
    headers = {"content-type": "application/json"}
    status, error, details = fail.status, {"message": fail.message}, []
    if fail.retry_after_s is not None:
        headers["retry-after"] = f"{fail.retry_after_s:g}"
    if provider == "gemini":
        if wait := headers.pop("retry-after", None):
            details = [{"@type": "google.rpc.RetryInfo", "retryDelay": f"{wait}s"}]
        if status == 401:  # Google refuses a wrong key with an ordinary 400
            status, details = 400, [{"@type": "google.rpc.ErrorInfo", "reason": "API_KEY_INVALID"}]
    return Raw(json.dumps({"error": {**error, "details": details}}).encode(), status, headers)


def _picture(kind: str, data: str) -> bytes:
    """Servers look at the file, not only at what is said of it."""
    picture = base64.b64decode(data, validate=True)
    if kind != ("image/jpeg" if picture.startswith(b"\xff\xd8\xff") else "image/png"):
        raise ValueError(kind)
    return picture


def _bearer(headers: Mapping[str, str]) -> str:
    return headers.get("authorization", "").removeprefix("Bearer ")
