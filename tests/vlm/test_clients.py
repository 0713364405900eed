"""The vendors' clients against fake servers that behave well, badly, or not."""

import json
import logging

import pytest

from tests.helpers.vlm_server import FAKE_MODEL, Broken, Fail, FakeVlmServer, Raw, Say
from torc.errors import InputError
from torc.testing.vlm_client_conformance import sample_png
from torc.vlm.answers import PLAN_SCHEMA
from torc.vlm.clients.api import OWN_SERVER_VARIABLE, VARIABLES, find_key, open_api_client, scrubbed
from torc.vlm.config import PROVIDERS, VlmConfig
from torc.vlm.failures import FailureKind, VlmError
from torc.vlm.prompt import Example
from torc.vlm.protocol import Finish, Question, VlmClient

SECRET = "another-vendor-key-that-stays-here"
KEY = "key-of-torc-testing-0123456789"
IMAGE = "iVBORw0KGgo"
ECHO = f"your header was {KEY}, your image {IMAGE * 40}"
PLAN = [{"action": "remove", "input": 3}, {"action": "pick", "input": 0}]
ANSWER = {"thoughts": "3 stands before 0", "plan": PLAN}
TEXT = json.dumps(ANSWER)
GOOD = Say(TEXT)
QUESTION = Question("Which object first?", (sample_png(),), PLAN_SCHEMA, repeat=5)
EVERY_PROVIDER = pytest.mark.parametrize("provider", PROVIDERS)


@pytest.fixture(autouse=True)
def environment(monkeypatch):
    """The user's own keys for the vendors are set; only the own server's key may be used."""
    for variables in VARIABLES.values():
        for variable in variables:
            monkeypatch.setenv(variable, SECRET)
    monkeypatch.setenv(OWN_SERVER_VARIABLE, KEY)


def config_for(server, **options):
    options = {"timeout_s": 5, "retries": 0, "retry_wait_s": 0.0, **options}
    return VlmConfig(server.provider, "some-model", server.url, **options)


REPLIES = {
    "JSON as asked for": ([GOOD], ANSWER),
    "thinking before it": ([Say(TEXT, thoughts="[7] or {8}? I choose 3.")], ANSWER),
    "a bare array": ([Say(f"First 3, then 0.\n```\n{json.dumps(PLAN)}\n```")], PLAN),
    "no JSON at all": ([Say("I would pick object 3.")], None),
    "echoes the key and an image": ([Say(f"{ECHO} {TEXT}")], ANSWER),
    "rate limit that passes": ([Fail(429, retry_after_s=0), Fail(429), GOOD], ANSWER),
    "server errors that pass": ([Fail(500), Fail(529), GOOD], ANSWER),
    "lost connection that passes": ([Broken.HANG_UP, GOOD], ANSWER),
    "time-out that passes": ([Say(TEXT, late_s=60), GOOD], ANSWER),
}


@EVERY_PROVIDER
@pytest.mark.parametrize("case", REPLIES)
def test_good_replies_come_through(provider, case):
    script, answer = REPLIES[case]
    timeout_s = 0.8 if "time-out" in case else 20
    with FakeVlmServer(provider, script, KEY) as server:
        reply = open_api_client(config_for(server, retries=2, timeout_s=timeout_s)).ask(QUESTION)
    assert len(server.asked) == len(script)
    sent = server.asked[0]
    assert (sent.model, sent.prompt, sent.images) == ("some-model", QUESTION.prompt, QUESTION.images)
    assert sent.schema == QUESTION.schema
    assert (reply.finish, reply.answer, reply.model_version) == (Finish.COMPLETE, answer, FAKE_MODEL)
    assert (reply.tokens.prompt, reply.tokens.thinking) == (300, 5)
    assert reply.tokens.reply is not None
    assert reply.latency_s > 0
    assert KEY not in reply.text
    assert IMAGE * 9 not in reply.text


@EVERY_PROVIDER
def test_two_pictures_a_system_text_and_examples_go_where_the_vendor_wants_them(provider):
    other = sample_png()[:-1] + b"!"
    examples = (Example("Which of 4, 5?", '{"plan": []}'), Example("Of 6?", "6."))
    question = Question("Now?", (sample_png(), other), PLAN_SCHEMA, system="Be a robot.", examples=examples)
    with FakeVlmServer(provider, [GOOD], KEY) as server:
        client = open_api_client(config_for(server))
        assert client.ask(question).answer == ANSWER
        client.ask(QUESTION)
    sent, bare = server.asked
    assert (sent.prompt, sent.images, sent.system) == ("Now?", question.images, "Be a robot.")
    assert sent.turns == (
        *(("user", "Which of 4, 5?"), ("model", '{"plan": []}')),
        *(("user", "Of 6?"), ("model", "6.")),
    )
    assert (bare.system, bare.turns) == ("", ())


@EVERY_PROVIDER
def test_what_was_written_counts_thinking_in_whoever_counts(provider):
    with FakeVlmServer(provider, [GOOD], KEY) as server:
        tokens = open_api_client(config_for(server)).ask(QUESTION).tokens
    assert (tokens.prompt, tokens.reply, tokens.thinking) == (300, 25, 5)


@EVERY_PROVIDER
@pytest.mark.parametrize(
    ("say", "finish"),
    [
        (Say(TEXT[:-20], "truncated"), Finish.TRUNCATED),
        (Say("", "refused"), Finish.REFUSED),
        (Say("", "empty"), Finish.EMPTY),
        (Say(" \n"), Finish.EMPTY),
    ],
)
def test_useless_replies_say_how_they_ended(provider, say, finish):
    with FakeVlmServer(provider, [say], KEY) as server:
        assert open_api_client(config_for(server)).ask(QUESTION).finish is finish


FAILURES = {
    "rate limit": (Fail(429), FailureKind.RATE_LIMIT, 3),
    "quota of the day": (Fail(429, retry_after_s=3600), FailureKind.RATE_LIMIT, 1),
    "server error": (Fail(500, ECHO), FailureKind.SERVER, 3),
    "key refused": (Fail(401, f"Incorrect API key provided: {KEY}"), FailureKind.AUTH, 1),
    "no access": (Fail(403), FailureKind.AUTH, 1),
    "no such model": (Fail(404), FailureKind.NOT_FOUND, 1),
    "bad request": (Fail(400, ECHO), FailureKind.BAD_REQUEST, 1),
    "time-out": (Say(TEXT, late_s=60), FailureKind.TIMEOUT, 3),
    "endless drip": (Broken.DRIP, FailureKind.TIMEOUT, 3),
    "garbage": (Raw(b"\x00\xff<html>not an API</html>"), FailureKind.BAD_RESPONSE, 3),
    "JSON of another form": (Raw(b'{"hello": ["world"]}'), FailureKind.BAD_RESPONSE, 3),
    "JSON that is no object": (Raw(b"[[[1]]]"), FailureKind.BAD_RESPONSE, 3),
    "error page": (Raw(b"<h1>Bad gateway</h1>", 502, {"content-type": "text/html"}), FailureKind.SERVER, 3),
}


@EVERY_PROVIDER
@pytest.mark.parametrize("case", FAILURES)
def test_failures_are_told_apart_and_hold_no_secret(provider, case, caplog):
    behavior, kind, requests = FAILURES[case]
    timeout_s = 0.4 if kind is FailureKind.TIMEOUT else 20
    with FakeVlmServer(provider, [behavior], KEY) as server, caplog.at_level(logging.DEBUG):
        client = open_api_client(config_for(server, retries=2, timeout_s=timeout_s))
        with pytest.raises(VlmError) as caught:
            client.ask(QUESTION)
    assert (caught.value.kind, len(server.asked)) == (kind, requests)
    # Another error behind it would show its text, which nobody has scrubbed.
    assert caught.value.__context__ is caught.value.__cause__ is None
    for text in (str(caught.value), caplog.text):
        assert KEY not in text
        assert IMAGE * 9 not in text


@EVERY_PROVIDER
@pytest.mark.parametrize("key", [KEY, None])
def test_clients_keep_to_the_protocol_and_send_nobody_elses_secret(provider, key, monkeypatch):
    if key is None:
        monkeypatch.delenv(OWN_SERVER_VARIABLE)
    with FakeVlmServer(provider, [Say("[]")], key) as server:
        client = open_api_client(config_for(server))
        assert isinstance(client, VlmClient)
        client.ask(Question("?", (sample_png(),)))
    assert server.asked[0].key == (key or "")
    assert SECRET not in str(server.headers)


@EVERY_PROVIDER
def test_a_redirect_is_not_followed(provider):
    with FakeVlmServer(provider, [Say("[]")]) as elsewhere:
        redirect = Raw(status=307, headers={"location": elsewhere.url})
        with FakeVlmServer(provider, [redirect]) as server, pytest.raises(VlmError) as caught:
            open_api_client(config_for(server)).ask(Question("?"))
        assert caught.value.kind is FailureKind.BAD_RESPONSE
        assert elsewhere.headers == []


@EVERY_PROVIDER
def test_a_server_that_is_not_there_is_a_lost_connection(provider):
    with FakeVlmServer(provider, [Say("[]")]) as server:
        config = config_for(server)
    with pytest.raises(VlmError, match="no connection") as caught:
        open_api_client(config).ask(Question("?"))
    assert caught.value.kind is FailureKind.CONNECTION


@pytest.mark.parametrize(
    ("provider", "options", "sent"),
    [
        ("gemini", {"temperature": 0.5}, {"temperature": 0.5}),
        ("gemini", {"thinking": "medium"}, {"thinkingConfig": {"thinkingLevel": "MEDIUM"}}),
        ("gemini", {"thinking": 512}, {"thinkingConfig": {"thinkingBudget": 512}}),
        ("gemini", {"thinking": "off"}, {"thinkingConfig": {"thinkingBudget": 0}}),
        ("gemini", {"max_output_tokens": 99, "seeded": True}, {"maxOutputTokens": 99, "seed": 7}),
        ("openai", {"temperature": 0.0, "seeded": True}, {"temperature": 0.0, "seed": 7}),
        ("openai", {"max_output_tokens": 99}, {"max_tokens": 99}),
        ("openai", {"thinking": "medium"}, {"reasoning_effort": "medium"}),
        ("openai", {"thinking": "off"}, {"reasoning_effort": "none"}),
        ("anthropic", {"temperature": 0.5, "max_output_tokens": 99}, {"temperature": 0.5, "max_tokens": 99}),
        ("anthropic", {"thinking": "medium"}, {"thinking": {"type": "adaptive"}, "effort": "medium"}),
        ("anthropic", {"thinking": 2048}, {"thinking": {"type": "enabled", "budget_tokens": 2048}}),
        ("anthropic", {"thinking": "off"}, {"thinking": {"type": "disabled"}}),
    ],
)
def test_options_reach_the_server_under_the_vendors_names(provider, options, sent):
    with FakeVlmServer(provider, [Say("[]")]) as server:
        for given in (options, {}):
            open_api_client(config_for(server, **given)).ask(Question("?", repeat=7))
    set_, plain = server.asked
    assert sent.items() <= set_.options.items()
    assert not (set(sent) - {"max_tokens"}) & set(plain.options)


@EVERY_PROVIDER
def test_free_text_sends_no_schema(provider):
    with FakeVlmServer(provider, [Say("[]")]) as server:
        open_api_client(config_for(server, structured=False)).ask(QUESTION)
    assert server.asked[0].schema is None
    assert "responseMimeType" not in server.asked[0].options


def test_keys_come_from_the_environment_and_stay_with_their_vendor(monkeypatch):
    assert find_key(VlmConfig("gemini", "m")) == SECRET
    assert find_key(VlmConfig("gemini", "m", "http://localhost:1")) == KEY
    monkeypatch.setenv("GEMINI_API_KEY", " ")
    assert find_key(VlmConfig("gemini", "m")) == SECRET  # GOOGLE_API_KEY
    monkeypatch.delenv("OPENAI_API_KEY")
    with pytest.raises(InputError, match="export OPENAI_API_KEY"):
        find_key(VlmConfig("openai", "m"))
    monkeypatch.setenv("ANTHROPIC_API_KEY", "a\nb")
    with pytest.raises(InputError, match="ANTHROPIC_API_KEY"):
        find_key(VlmConfig("anthropic", "m"))


def test_scrubbing_takes_out_keys_and_encoded_data_but_no_words():
    text = "a sentence with key-1 and " + "QUJD" * 60 + " and more"
    assert scrubbed(text, "key-1") == "a sentence with [key] and [data] and more"
    assert scrubbed("lone \ud800 half", None).isprintable()
