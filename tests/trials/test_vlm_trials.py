"""Whole trials with a VLM planner against a fake server: recorded, replayed, errored; no secret in their folders."""

import base64
import io
import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from rich.console import Console

from tests.helpers.fake_vlm import ScriptedVlm
from tests.helpers.trial_logs import comparable_log as _log
from tests.helpers.vlm_server import Fail, FakeVlmServer, Say
from torc.episode.privileged import Privileged, Truth
from torc.episode.progress import TerminalProgress
from torc.errors import InputError
from torc.pipeline.planners import make_planner
from torc.sim.visibility import Visibility
from torc.specs.trial import TrialSpec
from torc.testing import contexts
from torc.trials.trial import Situations, run_trial, situation_of
from torc.vlm.cache import CacheConfig, CacheMode
from torc.vlm.clients.api import OWN_SERVER_VARIABLE
from torc.vlm.config import VlmConfig
from torc.vlm.prices import Prices
from torc.vlm.simulated.profiles import PROFILES

KEY = "key-of-these-tests-0123456789"
SPEC = TrialSpec.of("structured-04", "vlm-select", seed=3, max_picks=1)


@pytest.fixture(autouse=True)
def key(monkeypatch):
    monkeypatch.setenv(OWN_SERVER_VARIABLE, KEY)


def _silent(text):
    pass


def _spec(server):
    vlm = VlmConfig(
        "openai", "some-model", server.url, retries=1, retry_wait_s=0.0, prices=Prices(0.5, 10.0, "EUR")
    )
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
    assert first.result.status == "completed"
    assert first.result.outcomes == ("no valid choice",)
    assert len(images) == 3
    assert {(tmp_path / "a" / "picks" / "00_sent_1.png").read_bytes()} == set(images)
    use = {"calls": 3, "tokens_sent": 900, "tokens_written": 75, "tokens_thinking": 15}
    assert first.result.vlm_use.plain == {**use, "cost": pytest.approx(0.0012), "currency": "EUR"}
    _assert_no_secret(tmp_path, images)
    assert json.loads((tmp_path / "a" / "spec.json").read_text())["planner"]["vlm"]["model"] == "some-model"
    monkeypatch.delenv(OWN_SERVER_VARIABLE)
    replay = replace(cache, mode=CacheMode.REPLAY)
    run_trial(spec, tmp_path / "b", vlm_cache=replay, say=_silent)
    assert _log(tmp_path / "a") == _log(tmp_path / "b")
    missed = run_trial(replace(spec, seed=4), tmp_path / "c", vlm_cache=replay, say=_silent)
    assert missed.result.status == "errored"
    assert "holds no reply" in missed.result.error


def test_a_server_that_fails_makes_the_trial_errored(tmp_path):
    with FakeVlmServer("openai", [Fail(500, f"I was sent {KEY}")], KEY) as server:
        trial = run_trial(_spec(server), tmp_path / "a", say=_silent)
        images = [png for asked in server.asked for png in asked.images]
    assert trial.result.status == "errored"
    assert "server error" in trial.result.error
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


POOR = VlmConfig("simulated", "poor")


def _truth(objects, hidden=(), lies_on=()):
    hidden_by = np.zeros((objects, objects), dtype=np.int64)
    for back, front, pixels in hidden:
        hidden_by[back, front] = pixels
    return Truth(Visibility(np.full(objects, 100), np.full(objects, 1000), hidden_by), frozenset(lies_on))


def test_the_situation_is_what_the_simulator_and_the_pipeline_know():
    context = contexts.behind_context()
    found = situation_of(context, _truth(3, [(0, 1, 500), (0, 2, 29), (2, 1, 31)], [(2, 1)]))
    assert dict(found.in_sight) == {o.id: o.pixel_count for o in context.scene.objects}
    assert found.graspable == {1, 2}
    assert found.lies_on == {(2, 1)}
    assert dict(found.hides) == {(1, 0): 500, (1, 2): 31}  # 29 pixels are less than 3 % of the object
    assert found.blocks == {(1, 0)}
    assert found.near == {(0, 1)}
    assert found.removal_order() == (2, 1, 0)


def test_planners_stay_unprivileged_and_without_a_trial_nothing_is_told():
    for name in ("vlm-select", "vlm-grasps", "vlm-fixes-dg"):
        assert not isinstance(make_planner(name, client=ScriptedVlm(["?"])), Privileged)
    situations = Situations()
    assert isinstance(situations, Privileged)
    with pytest.raises(InputError, match="torc run"):
        situations.situation()


def test_a_trial_says_everywhere_that_its_vlm_is_simulated(tmp_path):
    text = io.StringIO()
    console = Console(file=text, width=200)
    spec = TrialSpec.of("structured-04", "vlm-select", seed=3, max_picks=1, vlm=POOR)
    with console.status("") as status:
        trial = run_trial(spec, tmp_path / "a", listeners=[TerminalProgress(console, status)], say=_silent)
    assert trial.result.status == "completed"
    assert trial.result.vlm == "simulated:poor"
    assert trial.result.participant is False
    assert trial.result.simulated_vlm == asdict(PROFILES["poor"])
    assert json.loads((tmp_path / "a" / "spec.json").read_text())["planner"]["vlm"]["provider"] == "simulated"
    assert "simulated" in spec.default_name
    assert text.getvalue().count("simulated:poor") >= 2  # who asks whom, and why this object
    log = _log(tmp_path / "a")
    decided = next(line for line in log if line["event"] == "decided")
    assert log[0]["vlm"] == "simulated:poor"
    assert "simulated:poor" in decided["reason"]
    assert all("Simulated VLM" in e["reply"] for e in decided["exchanges"] if e["reply"])
    assert {t["model_version"] for t in decided["evidence"]["vlm"]["tries"]} == {"simulated:poor"}


@pytest.mark.slow
def test_looking_up_the_truth_disturbs_nothing(tmp_path):
    """With the replies from a cache the trial goes as it went when the truth was looked up for them."""
    spec = TrialSpec.of("structured-04", "vlm-select", seed=3, max_picks=3, vlm=POOR)
    directory = tmp_path / "cache"
    for out, mode in (("a", CacheMode.RECORD), ("b", CacheMode.REPLAY)):
        run_trial(spec, tmp_path / out, vlm_cache=CacheConfig(directory, mode), say=_silent)
    assert _log(tmp_path / "a") == _log(tmp_path / "b")
    plain = run_trial(
        TrialSpec.of("structured-04", "random", seed=3, max_picks=1), tmp_path / "c", say=_silent
    )
    assert _log(tmp_path / "c")[1] == _log(tmp_path / "a")[1]
    assert plain.result.participant is True
    assert plain.result.vlm is None
