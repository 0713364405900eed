"""What every client of a vendor's protocol must do, as checks against a fake server that behaves well, badly, or not.

A client that asks in a way of its own: `torc.testing.vlm_client_conformance`.

    from torc.testing.vlm_conformance import CASES, check_case

    @pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
    def test_my_client_conforms(case):
        check_case("openai", open_my_client, case)     # a callable that takes a VlmConfig

The client is pointed at a server of the provider's kind that asks for the key KEY; that key must be where the
client finds keys.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from torc.testing.conformance import NonConformanceError
from torc.testing.vlm_server import Behaviour, CutOff, Drip, FakeVlmServer, Late, Raw
from torc.testing.vlm_wire_formats import FAKE_MODEL, Fail, Say
from torc.vlm.answers import PLAN_SCHEMA
from torc.vlm.config import VlmConfig
from torc.vlm.failures import FailureKind, VlmError
from torc.vlm.protocol import Finish, Question, Reply, VlmClient

KEY = "key-of-torc-testing-0123456789"
ClientFactory = Callable[[VlmConfig], VlmClient]
_PLAN = [{"action": "remove", "input": 3}, {"action": "pick", "input": 0}]
_ANSWER = {"thoughts": "3 stands before 0", "plan": _PLAN}
_TEXT = json.dumps(_ANSWER)
_GOOD = Say(_TEXT)
_ECHO = f"your header was {KEY}, your image {'iVBORw0KGgo' * 40}"


@dataclass(frozen=True)
class Case:
    """A server's behaviour, and what a client must make of it.

    Attributes:
        name: for reports.
        script: what the server does, request by request; the last repeats.
        finish: how the reply ends; None if there is to be none.
        answer: the JSON that is found in it.
        failure: why there is no reply.
        requests: how many requests the client sends (its configuration allows two retries).
        timeout_s: long where no time-out is the point, so that a busy machine changes nothing.
    """

    name: str
    script: tuple[Behaviour, ...]
    finish: Finish | None = Finish.COMPLETE
    answer: object = None
    failure: FailureKind | None = None
    requests: int = 1
    timeout_s: float = 20.0


def _reply(name: str, *script: Behaviour, answer: object = _ANSWER, requests: int = 1) -> Case:
    return Case(name, script, Finish.COMPLETE, answer, requests=requests)


def _useless(name: str, finish: Finish, say: Say) -> Case:
    return Case(name, (say,), finish)


def _failure(name: str, kind: FailureKind, requests: int, *script: Behaviour) -> Case:
    return Case(name, script, None, failure=kind, requests=requests)


CASES: tuple[Case, ...] = (
    _reply("JSON as asked for", _GOOD),
    _reply("thinking before it", Say(_TEXT, thoughts="[7] or {8}? I choose 3.")),
    _reply(
        "fenced and chatty", Say(f"Object 3 [a can] hides it.\n```json\n{_TEXT}\n```\nGood luck with [1]!")
    ),
    _reply("a bare array", Say(f"First 3, then 0.\n```\n{json.dumps(_PLAN)}\n```"), answer=_PLAN),
    _reply("no JSON at all", Say("I would pick object 3."), answer=None),
    _reply("JSON cut short, not marked so", Say('{"thoughts": "3 stands'), answer=None),
    _reply("echoes the key and an image", Say(f"{_ECHO} {_TEXT}")),
    Case("reply cut short", (Say(_TEXT[:-20], "truncated"),), Finish.TRUNCATED, answer=_PLAN[0]),
    _useless("refusal", Finish.REFUSED, Say("", "refused")),
    _useless("empty reply", Finish.EMPTY, Say("", "empty")),
    _useless("blank reply", Finish.EMPTY, Say(" \n")),
    _reply("rate limit that passes", Fail(429, retry_after_s=0), Fail(429), _GOOD, requests=3),
    _reply("server error that passes", Fail(500), Fail(503), _GOOD, requests=3),
    _reply("overload that passes", Fail(529), _GOOD, requests=2),
    Case("time-out that passes", (Late(60, _GOOD), _GOOD), answer=_ANSWER, requests=2, timeout_s=2),
    _reply("lost connection that passes", CutOff(_GOOD, 0), _GOOD, requests=2),
    _failure("rate limit", FailureKind.RATE_LIMIT, 3, Fail(429)),
    _failure("quota of the day", FailureKind.RATE_LIMIT, 1, Fail(429, retry_after_s=3600)),
    _failure("server error", FailureKind.SERVER, 3, Fail(500, _ECHO)),
    _failure("key refused", FailureKind.AUTH, 1, Fail(401, f"Incorrect API key provided: {KEY}")),
    _failure("no access", FailureKind.AUTH, 1, Fail(403)),
    _failure("no such model", FailureKind.NOT_FOUND, 1, Fail(404)),
    _failure("bad request", FailureKind.BAD_REQUEST, 1, Fail(400, _ECHO)),
    _failure("too large", FailureKind.BAD_REQUEST, 1, Fail(413)),
    Case("time-out", (Late(60, _GOOD),), None, failure=FailureKind.TIMEOUT, requests=3, timeout_s=1),
    Case("endless drip", (Drip(),), None, failure=FailureKind.TIMEOUT, requests=3, timeout_s=1),
    _failure("garbage", FailureKind.BAD_RESPONSE, 3, Raw(b"\x00\xff<html>not an API</html>", "text/html")),
    _failure("garbage as JSON", FailureKind.BAD_RESPONSE, 3, Raw(b"}{")),
    _failure("JSON of another form", FailureKind.BAD_RESPONSE, 3, Raw(b'{"hello": ["world"]}')),
    _failure("JSON that is no object", FailureKind.BAD_RESPONSE, 3, Raw(b"[[[1]]]")),
    _failure(
        "error page without JSON", FailureKind.SERVER, 3, Raw(b"<h1>Bad gateway</h1>", "text/html", 502)
    ),
)


def check_case(provider: str, open_client: ClientFactory, case: Case) -> None:
    """Runs one case. Raises NonConformanceError with everything that was broken."""
    _load_library(provider, open_client)
    with FakeVlmServer(provider, case.script, KEY) as server:
        config = VlmConfig(
            provider, "some-model", server.url, timeout_s=case.timeout_s, retries=2, retry_wait_s=0.0
        )
        question = Question("Which object first?", (sample_png(),), PLAN_SCHEMA, repeat=5)
        faults = _faults(open_client(config), question, case)
        if len(server.asked) != case.requests:
            faults.append(f"it sent {len(server.asked)} proper requests, not {case.requests}")
        for asked in server.asked[:1]:
            sent = (asked.model, asked.prompt, asked.images, asked.schema)
            if sent != ("some-model", question.prompt, question.images, question.schema):
                faults.append(
                    f"it sent another question: {asked.model}, {asked.prompt!r}, {len(asked.images)} images"
                )
    if faults:
        raise NonConformanceError(f"This client does not conform. {case.name}: " + "; ".join(faults))


@cache
def _load_library(provider: str, open_client: ClientFactory) -> None:
    """Libraries load parts of themselves with their first request, which may take longer than a case's time-out."""
    with FakeVlmServer(provider, (_GOOD,)) as server:
        open_client(VlmConfig(provider, "some-model", server.url)).ask(Question("?"))


def sample_png() -> bytes:
    """A small picture."""
    image = np.random.default_rng(1).integers(0, 255, (48, 64, 3)).astype(np.uint8)
    return cv2.imencode(".png", image)[1].tobytes()


def _faults(client: VlmClient, question: Question, case: Case) -> list[str]:
    try:
        reply = client.ask(question)
    except VlmError as error:
        faults = _secrets(str(error))
        if error.__context__ is not None or error.__cause__ is not None:
            faults.append("the error carries another one, whose text nobody has scrubbed")
        if error.kind is not case.failure:
            faults.append(f"it failed with '{error.kind}', not '{case.failure}': {error}")
        return faults
    if case.finish is None:
        return [f"it replied {reply.text!r}; there was to be a failure: {case.failure}"]
    return _reply_faults(reply, case)


def _reply_faults(reply: Reply, case: Case) -> list[str]:
    faults = _secrets(reply.text)
    if reply.finish is not case.finish:
        faults.append(f"the reply ended '{reply.finish}', not '{case.finish}'")
    if reply.answer != case.answer:
        faults.append(f"the answer is {reply.answer!r}, not {case.answer!r}")
    if reply.model_version != FAKE_MODEL:
        faults.append(f"the model version is {reply.model_version!r}, not the server's")
    if reply.tokens.prompt != 300 or reply.tokens.reply is None or reply.tokens.thinking != 5:
        faults.append(f"the tokens are {reply.tokens}")
    if not reply.latency_s > 0:
        faults.append(f"the latency is {reply.latency_s}")
    return faults


def _secrets(text: str) -> list[str]:
    secrets = {"the key": KEY, "image data": "iVBORw0KGgo" * 9}
    return [f"{what} is in its text" for what, secret in secrets.items() if secret in text]
