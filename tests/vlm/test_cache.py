"""Record, replay, off; and what a key depends on."""

import json
from dataclasses import replace

import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from tests.helpers.vlm_server import Fail, FakeVlmServer, Say
from torc.errors import InputError
from torc.pipeline.planners import open_client
from torc.vlm.cache import CacheConfig, CachedClient, CacheMode, cache_key, request_facts
from torc.vlm.clients.api import VARIABLES
from torc.vlm.config import VlmConfig
from torc.vlm.failures import VlmError
from torc.vlm.protocol import Finish, Question

CONFIG = VlmConfig("gemini", "some-model")
QUESTION = Question("Which first?", (b"picture",), {"type": "object", "properties": {}}, repeat=3)


def test_a_reply_is_asked_for_once_and_replayed_as_it_was(tmp_path):
    model = ScriptedVlm(["[1]", "[2]"])
    client = CachedClient(CONFIG, tmp_path / "cache", model)
    first = client.ask(QUESTION)
    assert client.ask(QUESTION) == first
    assert client.ask(replace(QUESTION, repeat=4)).answer == [2]
    assert len(model.questions) == 2
    assert CachedClient(CONFIG, tmp_path / "cache").ask(QUESTION) == first


@pytest.mark.parametrize(
    "other",
    [
        {"provider": "anthropic"},
        {"base_url": "http://localhost:1"},
        {"model": "other"},
        {"temperature": 0.0},
        {"thinking": "low"},
        {"max_output_tokens": 10},
        {"seeded": True},
        {"structured": False},
        {"prompt": "Which?"},
        {"images": (b"another",)},
        {"images": ()},
        {"schema": {"type": "array"}},
        {"repeat": 0},
    ],
    ids=str,
)
def test_everything_that_can_change_a_reply_changes_the_key(other):
    of_question = {k: v for k, v in other.items() if k in ("prompt", "images", "schema", "repeat")}
    config = replace(CONFIG, **{k: v for k, v in other.items() if k not in of_question})
    changed = request_facts(config, replace(QUESTION, **of_question))
    assert cache_key(changed) != cache_key(request_facts(CONFIG, QUESTION))


def test_keys_stay_the_same_from_version_to_version():
    """If this fails, published caches no longer replay: raise the cache's format instead."""
    key = cache_key(request_facts(CONFIG, QUESTION))
    assert key == "4a5ba5634f2bf68e97068a4e94d855bc22ee6267efbf917176dcface855138fb"


def test_replaying_asks_nobody_and_needs_no_key(tmp_path, monkeypatch):
    for variable in VARIABLES["gemini"]:
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(InputError, match="no VLM cache"):
        open_client(CONFIG, CacheConfig(tmp_path / "none", CacheMode.REPLAY))
    CachedClient(CONFIG, tmp_path, ScriptedVlm(["[1]"])).ask(QUESTION)
    client = open_client(CONFIG, CacheConfig(tmp_path, CacheMode.REPLAY))
    assert client.ask(QUESTION).answer == [1]
    with pytest.raises(InputError, match="holds no reply"):
        client.ask(replace(QUESTION, prompt="Another?"))
    for mode in (CacheMode.RECORD, CacheMode.OFF):
        with pytest.raises(InputError, match="No key"):
            open_client(CONFIG, CacheConfig(tmp_path, mode))


def test_errors_are_not_recorded_and_refusals_are(tmp_path):
    with FakeVlmServer("openai", [Fail(500), Say("", "refused"), Say("[1]")]) as server:
        config = VlmConfig("openai", "m", server.url, retries=0)
        client = open_client(config, CacheConfig(tmp_path, CacheMode.RECORD))
        with pytest.raises(VlmError):
            client.ask(QUESTION)
        assert list(tmp_path.rglob("*.json")) == []
        assert client.ask(QUESTION).finish is client.ask(QUESTION).finish is Finish.REFUSED
        assert client.ask(replace(QUESTION, repeat=4)).answer == [1]
        off = open_client(config, CacheConfig(tmp_path, CacheMode.OFF))
        assert off.ask(QUESTION).answer == [1]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda d: "{",
        lambda d: json.dumps({**d, "request": {**d["request"], "prompt": "Another?"}}),
        lambda d: json.dumps({**d, "reply": {**d["reply"], "text": 5}}),
        lambda d: json.dumps({**d, "reply": {**d["reply"], "tokens": {"prompt": "many"}}}),
        lambda d: "[" * 50_000,
        lambda d: " " * 5_000_000,
    ],
)
def test_a_damaged_file_is_named(tmp_path, spoil):
    client = CachedClient(CONFIG, tmp_path, ScriptedVlm(["[1]"]))
    client.ask(QUESTION)
    (file,) = tmp_path.rglob("*.json")
    file.write_text(spoil(json.loads(file.read_text())))
    with pytest.raises(InputError, match="damaged") as caught:
        client.ask(QUESTION)
    assert file.name in str(caught.value)


def test_a_cache_holds_no_image_and_no_key(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_VLM_API_KEY", "key-0123456789")
    with FakeVlmServer("anthropic", [Say("my key is key-0123456789")]) as server:
        config = VlmConfig("anthropic", "m", server.url)
        image = b"\x89PNG not really, but long enough to be found " * 5
        open_client(config, CacheConfig(tmp_path)).ask(Question("?", (image,)))
    (file,) = tmp_path.rglob("*.json")
    assert b"key-0123456789" not in file.read_bytes()
    assert len(file.read_bytes()) < 1500
