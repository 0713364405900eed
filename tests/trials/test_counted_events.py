"""Logs are read in whole, or only what tables count of them."""

import json
import re

import numpy as np
import pytest

from tests.helpers.fake_bench import fake_trial
from torc.errors import InputError
from torc.trials.recorded import read_counted_events, read_events

COUNTED = {
    "looked": ("seconds",),
    "decided": ("attempts", "seconds"),
    "planned": ("score", "seconds"),
    "executed": ("result", "object_id", "meant_id", "held_after_lift", "dropped", "detail", "duration_s"),
}


def _log(path, *more):
    _, events = fake_trial("an id")
    log = path / "events.jsonl"
    log.write_text("".join(json.dumps(event) + "\n" for event in (*events, *more)))
    return log


def test_what_is_counted_is_what_the_whole_log_says(tmp_path):
    rng = np.random.default_rng(0)
    numbers = [float(x) for x in rng.lognormal(-4, 9, 200)]
    looked = {"event": "looked", "pick": 5, "target_visible": True, "objects": [], "graspable": []}
    planned = ({"event": "planned", "pick": 5, "seconds": x, "score": 1 / x} for x in numbers)
    odd = {"event": "executed", "pick": 5, "result": "slipped", "object_id": 3, "true_id": 4}
    log = _log(tmp_path, looked | {"seconds": {"grasps": 1.5}}, *planned, odd | {"detail": "\u00e9 \ud83d"})
    whole, counted = read_events(log), read_counted_events(log)
    assert [(e.event, e.pick) for e in counted] == [(e.event, e.pick) for e in whole]
    for ours, theirs in zip(counted, whole):
        assert [getattr(ours, k) for k in COUNTED[ours.event]] == [
            getattr(theirs, k) for k in COUNTED[ours.event]
        ]
    assert counted[-1].meant_id == 4
    assert counted[-1].detail == "\u00e9 \ufffd"


def test_nan_is_unknown_in_both(tmp_path):
    log = _log(tmp_path, {"event": "planned", "pick": 0, "score": float("nan")})
    assert read_counted_events(log)[-1].score is read_events(log)[-1].score is None


@pytest.mark.parametrize("line", ["{", '{"event": "planned"}', '{"event": "sung", "pick": 0}', "[" * 5000])
def test_a_line_that_is_no_event_is_named_by_both(tmp_path, line):
    log = _log(tmp_path)
    number = len(log.read_text().splitlines()) + 1
    log.write_text(log.read_text() + line + "\n")
    for read in (read_events, read_counted_events):
        with pytest.raises(InputError, match=f"{re.escape(str(log))}, line {number}: "):
            read(log)


@pytest.mark.parametrize(
    ("written", "read"),
    [
        (r"\ud83d\ude00", "\N{GRINNING FACE}"),
        (r"\ud83d", "\ufffd"),
        (r"\uDE00", "\ufffd"),
        (r"\ud83d\ud83d\ude00", "\ufffd\N{GRINNING FACE}"),
        (r"\ud83d\ude00\ude00", "\N{GRINNING FACE}\ufffd"),
        (r"\u00e9", "\u00e9"),
    ],
)
def test_half_a_surrogate_pair_is_replaced(tmp_path, written, read):
    log = tmp_path / "events.jsonl"
    line = '{"event": "executed", "pick": 0, "result": "missed", "object_id": 1, "detail": "%s"}\n'
    log.write_text(line % written)
    assert [e.detail for e in (*read_events(log), *read_counted_events(log))] == [read, read]
