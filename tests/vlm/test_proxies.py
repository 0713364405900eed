"""Servers on this machine are asked directly; where a proxy was used, the message names it without its password."""

import pytest

from tests.helpers.vlm_server import FakeVlmServer, Raw, Say
from torc.vlm.clients.api import open_api_client
from torc.vlm.clients.proxies import find_proxy, is_loopback
from torc.vlm.config import VlmConfig
from torc.vlm.failures import FailureKind, VlmError
from torc.vlm.protocol import Question

VARIABLES = ("http_proxy", "HTTP_PROXY", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY")
ADDRESSES = (
    "127.0.0.1",
    "localhost",
    "LOCALHOST.",
    "127.8.9.10",
    "127.1",
    "0.0.0.0",
    "::1",
    "::ffff:127.0.0.1",
)


@pytest.fixture(autouse=True)
def no_proxies(monkeypatch):
    for name in (*VARIABLES, "no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)


def config_for(url, **options):
    return VlmConfig("openai", "m", url, **{"timeout_s": 5, "retries": 0, "retry_wait_s": 0.0, **options})


@pytest.mark.parametrize("variable", VARIABLES)
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_server_on_this_machine_is_asked_directly(variable, host, monkeypatch):
    with FakeVlmServer("openai", [Say("[]")]) as proxy, FakeVlmServer("openai", [Say("[]")]) as server:
        monkeypatch.setenv(variable, proxy.url)
        url = server.url.replace("127.0.0.1", host)
        assert open_api_client(config_for(url)).ask(Question("?")).text == "[]"
        assert (len(server.asked), proxy.headers) == (1, [])


def test_addresses_of_this_machine_and_of_others():
    assert all(map(is_loopback, ADDRESSES))
    others = (
        "128.0.0.1",
        "192.168.1.5",
        "localhost.example.com",
        "mylocalhost",
        "fe80::1",
        "127.example.com",
        "",
    )
    assert not any(map(is_loopback, others))


def test_a_refused_request_names_the_proxy_but_not_its_password(monkeypatch):
    with FakeVlmServer("openai", [Say("[]")]) as proxy:
        address = proxy.url.removeprefix("http://").removesuffix("/v1")
        monkeypatch.setenv("http_proxy", f"http://some-user:s3cr%40t@{address}")
        with pytest.raises(VlmError) as caught:
            open_api_client(config_for("http://models.example.com/v1")).ask(Question("?"))
    assert proxy.headers[0]["host"] == "models.example.com"
    text = str(caught.value)
    assert f"the proxy http://{address}" in text
    assert "no_proxy=models.example.com" in text
    assert not any(secret in text for secret in ("some-user", "s3cr%40t", "s3cr@t"))


@pytest.mark.parametrize(
    "given", ["http://user:s3cret@127.0.0.1:1", "user:s3cret@127.0.0.1:1", "http://user:s3cret"]
)
@pytest.mark.parametrize("scheme", ["http", "https"])
def test_a_proxy_that_is_not_there_or_malformed_is_named_without_password(given, scheme, monkeypatch):
    monkeypatch.setenv(f"{scheme}_proxy", given)
    with pytest.raises(VlmError, match="asked through the proxy") as caught:
        open_api_client(config_for(f"{scheme}://models.example.com/v1")).ask(Question("?"))
    assert caught.value.kind is FailureKind.CONNECTION
    assert "s3cret" not in str(caught.value)


def test_a_proxy_that_wants_a_password_is_not_asked_again(monkeypatch):
    refusal = Raw(b"Proxy Authentication Required", 407, {"content-type": "text/plain"})
    with FakeVlmServer("gemini", [refusal]) as proxy:
        proxy.behavior_for = lambda *_: refusal
        monkeypatch.setenv("http_proxy", proxy.url)
        with pytest.raises(VlmError, match="asked once: proxy refused") as caught:
            open_api_client(config_for("http://models.example.com/v1", retries=3)).ask(Question("?"))
    assert caught.value.kind is FailureKind.PROXY


def test_no_proxy_is_heeded_and_an_unproxied_failure_names_none(monkeypatch):
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:1")
    assert find_proxy("http://models.example.com/v1").server == "models.example.com"
    assert find_proxy("https://models.example.com/v1") is None
    monkeypatch.setenv("no_proxy", "example.com")
    assert find_proxy("http://models.example.com:8000/v1") is None
    with pytest.raises(VlmError) as caught:
        open_api_client(config_for("http://127.0.0.1:1/v1")).ask(Question("?"))
    assert "proxy" not in str(caught.value)
