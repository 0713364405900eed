"""Nobody takes torc's numbers for the frame's labels."""

import json
import re

import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from torc.brain import answer_text, decide_frame
from torc.brain.answer import evidence_in_labels
from torc.task_planning.registry import make_planner

IDS = {"0", "1"}
"""Ids that torc gives the labels 512 and 40000."""
PLANNERS = {
    "random": None,
    "dg-select": None,
    "vlm-select": '{"plan": [{"action": "remove", "input": 1}]}',
    "vlm-fixes-dg": '{"relations": [{"source": 0, "relation": "below", "target": 7}]}',
}


def planner_of(name: str):
    reply = PLANNERS[name]
    return make_planner(name, **({} if reply is None else {"client": ScriptedVlm([reply])}))


def numbers(value, key: str = "") -> set[str]:
    """Whole numbers that stand for an object: under a key that names one, as a key, or in a sentence."""
    if isinstance(value, dict):
        keys = {k for k in value if k.isdigit()}
        return keys.union(*(numbers(v, k) for k, v in value.items()))
    if isinstance(value, list):
        return set().union(*(numbers(v, key) for v in value))
    if key in ("label", "source", "target", "id", "graspable"):
        return {str(value)}
    return set(re.findall(r"(?<=Pick )\d+|(?<=target )\d+|\d+(?= (?:below|behind))", str(value)))


@pytest.mark.parametrize("target", [512, "hidden"])
@pytest.mark.parametrize("name", PLANNERS)
def test_reasons_and_json_hold_labels_alone(frame_of, name, target):
    labels = {"7", "512", "40000", "23", "hidden"}
    answer = decide_frame(frame_of(target=target), planner_of(name))
    told = json.loads(json.dumps(answer.to_dict()))
    for o in told["objects"]:
        del o["id"]
    found = numbers({k: v for k, v in told.items() if k not in ("exchanges", "seconds")})
    assert found <= labels
    assert "40000" in found
    assert not IDS & set(re.findall(r"Pick (\d+)", answer_text(answer)))


def test_what_somebodys_planner_leaves_passes_as_it_is():
    evidence = {"graph": [1, 2], "probabilities": "none", "certainty": {}, "pixels": {"1": 40}}
    assert evidence_in_labels(evidence, {0: 512, 1: 40_000}) == evidence
