"""Whole trials with a VLM planner against a fake server: recorded, replayed, errored; no secret in their folders."""

import base64
import json
from dataclasses import replace

import pytest

from tests.helpers.trial_logs import comparable_log as _log
from tests.helpers.vlm_server import Fail, FakeVlmServer, Say
from torc.episode.trial import run_trial
from torc.errors import InputError
from torc.specs.trial import TrialSpec
from torc.vlm.cache import CacheConfig, CacheMode
from torc.vlm.config import VlmConfig
from torc.vlm.keys import OWN_SERVER_VARIABLE

KEY = "key-of-these-tests-0123456789"
SPEC = TrialSpec.of("structured-04", "vlm-select", seed=3, max_picks=1)


@pytest.fixture(autouse=True)
def key(monkeypatch):
    monkeypatch.setenv(OWN_SERVER_VARIABLE, KEY)


def _silent(text):
    pass


def _spec(server):
    vlm = VlmConfig("openai", "some-model", server.url, retries=1, retry_wait_s=0.0)
    return replace(SPEC, planner=replace(SPEC.planner, vlm=vlm))


def _assert_no_secret(directory, images):
    """Neither the key nor a piece of an image as it was sent is in any file."""
    pieces = [KEY.encode(), *(base64.b64encode(png)[300:360] for png in images)]
    for file in directory.rglob("*"):
        if file.is_file():
            assert not any(piece in file.read_bytes() for piece in pieces), file


def test_a_trial_is_recorded_and_replays_without_a_server(tmp_path, monkeypatch):
    cache = CacheConfig(tmp_path / "cache")
    with FakeVlmServer("openai", [Say(f"your key {KEY}"), Say("[1"), Say("No.")], KEY) as server:
        spec = _spec(server)
        first = run_trial(spec, tmp_path / "a", vlm_cache=cache, say=_silent)
        images = [png for asked in server.asked for png in asked.images]
    assert first.result["status"] == "completed"
    assert first.result["outcomes"] == ["no valid choice"]
    assert len(images) == 3
    _assert_no_secret(tmp_path, images)
    assert json.loads((tmp_path / "a" / "spec.json").read_text())["planner"]["vlm"]["model"] == "some-model"
    monkeypatch.delenv(OWN_SERVER_VARIABLE)
    replay = replace(cache, mode=CacheMode.REPLAY)
    run_trial(spec, tmp_path / "b", vlm_cache=replay, say=_silent)
    assert _log(tmp_path / "a") == _log(tmp_path / "b")
    missed = run_trial(replace(spec, seed=4), tmp_path / "c", vlm_cache=replay, say=_silent)
    assert missed.result["status"] == "errored"
    assert "holds no reply" in missed.result["error"]


def test_a_server_that_fails_makes_the_trial_errored(tmp_path):
    with FakeVlmServer("openai", [Fail(500, f"I was sent {KEY}")], KEY) as server:
        trial = run_trial(_spec(server), tmp_path / "a", say=_silent)
        images = [png for asked in server.asked for png in asked.images]
    assert trial.result["status"] == "errored"
    assert "server error" in trial.result["error"]
    assert "picks" not in trial.result
    assert len(images) == 2
    _assert_no_secret(tmp_path, images)


def test_what_cannot_be_asked_is_refused_before_anything_is_run(tmp_path):
    with pytest.raises(InputError, match="--vlm"):
        run_trial(SPEC, tmp_path / "a", say=_silent)
    with pytest.raises(InputError, match="no VLM cache"):
        run_trial(
            replace(SPEC, planner=replace(SPEC.planner, vlm=VlmConfig("gemini", "m"))),
            tmp_path / "a",
            vlm_cache=CacheConfig(tmp_path / "none", CacheMode.REPLAY),
            say=_silent,
        )
    assert list(tmp_path.iterdir()) == []
