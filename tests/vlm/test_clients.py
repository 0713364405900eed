"""The vendors' clients against fake servers that speak their wire formats."""

import logging
import os
import subprocess
import sys

import pytest

from torc.errors import InputError, MissingDependencyError
from torc.testing.vlm_conformance import CASES, KEY, check_case, sample_png
from torc.testing.vlm_server import FakeVlmServer, Redirect
from torc.testing.vlm_wire_formats import Say
from torc.vlm.clients.opening import open_api_client
from torc.vlm.config import PROVIDERS, VlmConfig
from torc.vlm.failures import FailureKind, VlmError
from torc.vlm.keys import OWN_SERVER_VARIABLE, VARIABLES, find_key, scrubbed
from torc.vlm.protocol import Question, VlmClient

SECRET = "another-vendor-key-that-stays-here"


@pytest.fixture(autouse=True)
def environment(monkeypatch):
    """The user's own keys and addresses for the vendors are set; only the own server's key may be used."""
    for variables in VARIABLES.values():
        for variable in variables:
            monkeypatch.setenv(variable, SECRET)
    for name in ("OPENAI_ORG_ID", "OPENAI_PROJECT_ID", "OPENAI_ADMIN_KEY", "ANTHROPIC_AUTH_TOKEN"):
        monkeypatch.setenv(name, SECRET)
    for name in ("OPENAI_BASE_URL", "ANTHROPIC_BASE_URL", "GOOGLE_GEMINI_BASE_URL"):
        monkeypatch.setenv(name, "http://127.0.0.1:9/nowhere")
    monkeypatch.setenv("GOOGLE_GENAI_USE_VERTEXAI", "true")
    monkeypatch.setenv(OWN_SERVER_VARIABLE, KEY)


def config_for(server, provider, **options):
    return VlmConfig(provider, "some-model", server.url, timeout_s=5, retries=0, **options)


@pytest.mark.parametrize("provider", PROVIDERS)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_all_clients_conform(provider, case, caplog):
    with caplog.at_level(logging.DEBUG):
        check_case(provider, open_api_client, case)
    assert KEY not in caplog.text
    assert "iVBORw0KGgo" not in caplog.text


@pytest.mark.parametrize("provider", PROVIDERS)
def test_clients_keep_to_the_protocol_and_send_nobody_elses_secret(provider):
    with FakeVlmServer(provider, [Say("[]")], KEY) as server:
        client = open_api_client(config_for(server, provider))
        assert isinstance(client, VlmClient)
        client.ask(Question("?", (sample_png(),)))
        assert SECRET not in str(server.headers)


@pytest.mark.parametrize("provider", PROVIDERS)
def test_a_server_without_a_key_is_sent_none(provider, monkeypatch):
    monkeypatch.delenv(OWN_SERVER_VARIABLE)
    with FakeVlmServer(provider, [Say("[]")]) as server:
        assert open_api_client(config_for(server, provider)).ask(Question("?")).answer == []
        assert "no-key" in str(server.headers)
        assert SECRET not in str(server.headers)


@pytest.mark.parametrize("provider", PROVIDERS)
def test_a_redirect_is_not_followed(provider):
    with FakeVlmServer(provider, [Say("[]")]) as elsewhere:
        with FakeVlmServer(provider, [Redirect(elsewhere.url)]) as server, pytest.raises(VlmError) as caught:
            open_api_client(config_for(server, provider)).ask(Question("?"))
        assert caught.value.kind is FailureKind.BAD_RESPONSE
        assert elsewhere.headers == []


@pytest.mark.parametrize("provider", PROVIDERS)
def test_a_server_that_is_not_there_is_a_lost_connection(provider):
    with FakeVlmServer(provider, [Say("[]")]) as server:
        config = config_for(server, provider)
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
        (
            "openai",
            {"thinking": "medium", "max_output_tokens": 99},
            {"reasoning_effort": "medium", "max_tokens": 99},
        ),
        ("openai", {"thinking": "off"}, {"reasoning_effort": "none"}),
        ("anthropic", {"temperature": 0.5, "max_output_tokens": 99}, {"temperature": 0.5, "max_tokens": 99}),
        ("anthropic", {"thinking": "medium"}, {"thinking": {"type": "adaptive"}, "effort": "medium"}),
        ("anthropic", {"thinking": 2048}, {"thinking": {"type": "enabled", "budget_tokens": 2048}}),
        ("anthropic", {"thinking": "off"}, {"thinking": {"type": "disabled"}}),
    ],
)
def test_options_reach_the_server_under_the_vendors_names(provider, options, sent):
    with FakeVlmServer(provider, [Say("[]")]) as server:
        open_api_client(config_for(server, provider, **options)).ask(Question("?", repeat=7))
        plain = FakeVlmServer(provider, [Say("[]")])
        with plain:
            open_api_client(config_for(plain, provider)).ask(Question("?", repeat=7))
    assert sent.items() <= dict(server.asked[0].options).items()
    unset = set(sent) - {"max_tokens"}
    assert not unset & set(plain.asked[0].options)


@pytest.mark.parametrize("provider", PROVIDERS)
def test_free_text_sends_no_schema(provider):
    with FakeVlmServer(provider, [Say("[]")]) as server:
        client = open_api_client(config_for(server, provider, structured=False))
        client.ask(Question("?", schema={"type": "object"}))
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


@pytest.mark.parametrize("provider", PROVIDERS)
def test_a_missing_library_names_the_line_that_installs_it(provider, monkeypatch):
    monkeypatch.setitem(sys.modules, "google" if provider == "gemini" else provider, None)
    with pytest.raises(MissingDependencyError, match=f"scripts/setup {provider}"):
        open_api_client(VlmConfig(provider, "m"))


def test_libraries_are_imported_only_when_a_client_is_opened():
    probe = (
        "import sys, torc.vlm.clients.opening, torc.vlm.clients.gemini, torc.vlm.clients.claude; "
        "import torc.vlm.clients.openai_compatible; print({'google', 'openai', 'anthropic'} & set(sys.modules))"
    )
    out = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True, env=os.environ
    )
    assert out.stdout.strip() == "set()"
