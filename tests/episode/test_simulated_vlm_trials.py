"""Trials with the simulated VLM: named as such everywhere, the same every time, and nobody but it sees the truth."""

import io
import json
from dataclasses import asdict

import numpy as np
import pytest
from rich.console import Console

from tests.helpers.fake_vlm import ScriptedVlm
from tests.helpers.trial_logs import comparable_log as _log
from torc.episode.planners import make_trial_planner
from torc.episode.privileged import Privileged, Truth
from torc.episode.progress import TerminalProgress
from torc.episode.trial import Situations, run_trial, situation_of
from torc.errors import InputError
from torc.sim.visibility import Visibility
from torc.specs.trial import TrialSpec
from torc.testing import contexts
from torc.vlm.cache import CacheConfig, CacheMode
from torc.vlm.config import VlmConfig
from torc.vlm.simulated.profiles import PROFILES

POOR = VlmConfig("simulated", "poor")


def _silent(text):
    pass


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
        assert not isinstance(make_trial_planner(name, client=ScriptedVlm(["?"])), Privileged)
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
    assert trial.result["status"] == "completed"
    assert trial.result["vlm"] == "simulated:poor"
    assert trial.result["participant"] is False
    assert trial.result["simulated_vlm"] == asdict(PROFILES["poor"])
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
    assert plain.result["participant"] is True
    assert plain.result["vlm"] is None
