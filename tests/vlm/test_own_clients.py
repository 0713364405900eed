"""VLM clients of somebody else's: by module and class, or by a registered name; good ones, and bad ones."""

from dataclasses import replace

import pytest

from torc.errors import InputError, UnknownNameError, VlmClientError
from torc.pipeline.planners import open_client
from torc.records.evidence import Tokens
from torc.testing import contexts
from torc.testing.conformance import NonConformanceError
from torc.testing.vlm_client_conformance import check_client
from torc.vlm.cache import CacheConfig
from torc.vlm.config import VlmConfig, parse_vlm
from torc.vlm.planners import VlmSelectPlanner
from torc.vlm.protocol import Question
from torc.vlm.replies import ask_client, reply_faults, reply_of

PLAN = '{"thoughts": "", "plan": [{"action": "remove", "input": 1}]}'
HERE = __name__


class Plain:
    """Takes nothing."""

    def ask(self, question):
        return reply_of(PLAN, "plain")


class Told:
    """Wants to know the model."""

    def __init__(self, config):
        self.config = config

    def ask(self, question):
        return reply_of(PLAN, self.config.model or "none")


class Mute:
    pass


class Wordy:
    def ask(self, question):
        return PLAN


class Crashing:
    def ask(self, question):
        raise RuntimeError("no GPU")


def _config(text):
    return VlmConfig(*parse_vlm(text))


def test_a_misspelt_vendor_is_no_module_and_a_module_is_no_misspelt_vendor(tmp_path, monkeypatch):
    with pytest.raises(UnknownNameError, match="Did you mean 'simulated'"):
        _config("simulatd:paper")
    with pytest.raises(InputError, match="Class for a client of your own"):
        _config("mine.Client")
    (tmp_path / "geminis.py").write_text("from torc.vlm.replies import reply_of\nclass Mine: ask = print\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert _config("geminis:Mine").provider == "geminis:Mine"


def test_a_class_is_made_and_asked():
    assert ask_client(open_client(_config(f"{HERE}:Plain")), Question("?")).model_version == "plain"
    client = open_client(replace(_config(f"{HERE}:Told:big@http://host"), temperature=0.5))
    assert ask_client(client, Question("?")).model_version == "big"
    assert (client.config.base_url, client.config.temperature) == ("http://host", 0.5)
    with pytest.raises(InputError, match="takes no `config`"):
        open_client(_config(f"{HERE}:Plain:big"))


def test_registered_names_work_as_the_vendors_do(monkeypatch):
    class Point:
        name, value = "theirs", f"{HERE}:Told"

    monkeypatch.setattr("torc.registry.loading.entry_points", lambda group: [Point] if "vlm" in group else [])
    for text, model in (("theirs", "none"), ("theirs:small", "small")):
        assert ask_client(open_client(_config(text)), Question("?")).model_version == model
    with pytest.raises(UnknownNameError, match="theirs"):
        VlmConfig("thiers", "m")


@pytest.mark.parametrize(("name", "told"), [("Mute", "needs a method `ask"), ("Gone", "has no 'Gone'")])
def test_what_is_no_client_is_refused_at_once(name, told):
    with pytest.raises(InputError, match=told):
        open_client(_config(f"{HERE}:{name}"))


@pytest.mark.parametrize(
    ("client", "told"),
    [(Wordy, "returned a str"), (Crashing, "RuntimeError: no GPU")],
)
def test_a_client_that_fails_is_to_blame_with_or_without_a_cache(client, told, tmp_path, rng):
    cached = open_client(_config(f"{HERE}:{client.__name__}"), CacheConfig(tmp_path))
    for each in (client(), cached):
        with pytest.raises(VlmClientError, match=told) as caught:
            VlmSelectPlanner(each).decide(contexts.behind_context(), rng)
        assert client.__name__ in str(caught.value)
    assert list(tmp_path.iterdir()) == []  # nothing of it is kept
    with pytest.raises(NonConformanceError, match=told.split(":")[0]):
        check_client(client)


GOOD = reply_of(PLAN, "m", tokens=Tokens(3, 4))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"text": b"{}"}, "text is a bytes"),
        ({"finish": "complete"}, "finish is a str"),
        ({"tokens": Tokens(prompt=-1)}, "tokens are"),
        ({"latency_s": float("nan")}, "latency_s is nan"),
        ({"answer": {1, 2}}, "answer is not data of JSON"),
    ],
)
def test_what_is_wrong_with_a_reply_is_said(change, told):
    assert list(reply_faults(GOOD)) == []
    assert any(told in fault for fault in reply_faults(replace(GOOD, **change)))
