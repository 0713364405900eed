"""An error inside an ordinary answer is shown in the server's words, and retried if it may pass."""

import json

import pytest

from tests.helpers.vlm_server import FakeVlmServer, Raw, Say
from torc.vlm.clients.api import open_api_client
from torc.vlm.config import VlmConfig
from torc.vlm.failures import FailureKind, VlmError, stated_error
from torc.vlm.protocol import Question

OVERLOADED = {"error": {"message": "upstream overloaded", "code": 503}}


def ask(server, **options):
    config = VlmConfig(server.provider, "m", server.url, **{"retries": 2, "retry_wait_s": 0.0, **options})
    return open_api_client(config).ask(Question("?"))


def raw(data):
    return Raw(json.dumps(data).encode())


@pytest.mark.parametrize("provider", ["openai", "gemini", "anthropic"])
def test_an_overload_inside_an_answer_is_retried_and_passes(provider):
    with FakeVlmServer(provider, [raw(OVERLOADED), Say("[]")]) as server:
        assert ask(server).text == "[]"
    assert len(server.asked) == 2


def test_an_overload_that_lasts_is_shown_in_the_servers_words():
    with FakeVlmServer("openai", [raw(OVERLOADED)]) as server, pytest.raises(VlmError) as caught:
        ask(server)
    assert "asked 3 times: server error" in str(caught.value)
    assert "503 upstream overloaded" in str(caught.value)


S, R, A, N, B = (
    FailureKind.SERVER,
    FailureKind.RATE_LIMIT,
    FailureKind.AUTH,
    FailureKind.NOT_FOUND,
    FailureKind.BAD_REQUEST,
)
FORMS = [
    ({"error": {"message": "slow down", "code": 429}}, R),
    ({"error": {"message": "slow down", "code": "429"}}, R),
    ({"error": {"message": "Overloaded", "type": "overloaded_error"}, "type": "error"}, S),
    ({"error": {"code": 503, "message": "busy", "status": "UNAVAILABLE"}}, S),
    ([{"error": {"code": 429, "message": "busy", "status": "RESOURCE_EXHAUSTED"}}], R),
    ({"error": {"message": "busy"}}, S),
    ({"error": "the model is loading"}, S),
    ({"choices": [], "error": {"message": "busy", "code": 502}}, S),
    ({"choices": [{"error": {"message": "cut off", "code": 502}, "message": {"content": ""}}]}, S),
    ({"object": "error", "message": "too long", "type": "BadRequestError", "code": 400}, B),
    ({"error": {"message": "no", "code": 401}}, A),
    ({"error": {"message": "no", "code": "invalid_api_key"}}, A),
    ({"error": {"message": "slow down", "type": "rate_limit_error"}}, R),
    ({"error": {"message": "pay", "type": "insufficient_quota", "code": None}}, A),
    ({"error": {"message": "no model", "code": "model_not_found"}}, N),
    ({"error": {"message": "temperature?", "type": "invalid_request_error"}}, B),
    ({"error": {"message": "pay", "code": 402}}, A),
    ({"error": {"message": "no model", "code": 404}}, N),
    ({"error": {"message": "temperature?", "code": 422}}, B),
]


@pytest.mark.parametrize(("data", "kind"), FORMS)
def test_codes_say_whether_to_ask_again(data, kind):
    assert stated_error(data).kind is kind


def test_what_holds_a_reply_or_nothing_states_no_error():
    reply = {"message": {"content": "[]"}}
    for data in ({"choices": [reply], "error": None}, {"error": {}}, {"hello": 1}, [[1]], 7, None):
        assert stated_error(data) is None


def test_an_error_that_lasts_is_not_asked_again():
    refusal = {"error": {"message": "no such option", "code": 400}}
    with (
        FakeVlmServer("openai", [raw(refusal)]) as server,
        pytest.raises(VlmError, match="asked once") as caught,
    ):
        ask(server)
    assert "no such option" in str(caught.value)
