"""What stays of asking a model: the pictures as they were sent, and what it took, also where the trial breaks."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from torc.episode.events import Decided
from torc.records.evidence import Tokens
from torc.testing import contexts
from torc.trials.recorder import TrialRecorder
from torc.trials.trial import recorded_trial
from torc.vlm.config import Asking, VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.planners import VlmSelectPlanner
from torc.vlm.prices import Prices
from torc.vlm.replies import reply_of

VLM = VlmConfig("gemini", "m", prices=Prices(1.0, 10.0, "EUR"))
PICTURE = PictureConfig("outlines", plain=True, crop_px=5)


class Counting:
    """First of no use, then an answer; each reply tells its tokens."""

    def __init__(self):
        self.questions = []

    def ask(self, question):
        self.questions.append(question)
        text = "?" if len(self.questions) == 1 else '{"plan": [{"action": "remove", "input": 1}]}'
        return reply_of(text, "counting", tokens=Tokens(1000, 50, 20))


def played(out, asked, broken=False):
    client, context = Counting(), contexts.behind_context()
    planner = VlmSelectPlanner(client, Asking(PICTURE))
    recorder = TrialRecorder(out, {})
    recorder.asked = asked

    def play():
        decision = planner.decide(context, np.random.default_rng(0))
        recorder(Decided(0, SimpleNamespace(context=context), decision, 0.1))
        if broken:
            raise RuntimeError("the simulation exploded")
        return {"status": "completed"}

    return recorded_trial(recorder, {}, play), client


@pytest.mark.parametrize("broken", [False, True])
def test_tokens_and_cost_of_all_calls_are_summed(tmp_path, broken):
    trial, _ = played(tmp_path / "a", VLM, broken)
    written = json.loads((trial.directory / "result.json").read_text())
    assert written["status"] == ("errored" if broken else "completed")
    counts = {"calls": 2, "tokens_sent": 2000, "tokens_written": 100, "tokens_thinking": 40}
    assert written["vlm_use"] == {**counts, "cost": pytest.approx(0.003), "currency": "EUR"}


def test_pictures_lie_beside_the_log_as_they_were_sent(tmp_path):
    trial, client = played(tmp_path / "a", VLM)
    files = sorted((trial.directory / "picks").glob("00_sent_*.png"))
    assert tuple(f.read_bytes() for f in files) == client.questions[0].images
    (line,) = (json.loads(text) for text in (trial.directory / "events.jsonl").read_text().splitlines())
    assert "pictures" not in line
    assert [p["shows"] for p in line["evidence"]["vlm"]["pictures"]] == ["marked", "plain"]


def test_where_no_model_is_asked_nothing_is_said_of_one(tmp_path):
    trial, _ = played(tmp_path / "a", None)
    assert "vlm_use" not in trial.result
