"""Evidence survives the log, and a stranger's log breaks nothing."""

import json

import numpy as np
import pytest

from torc.records import BeliefEvidence, Corrections, Evidence, ModelEvidence
from torc.records.evidence import ModelTry, Tokens
from torc.task_planning.belief.belief_planner import BeliefPlanner
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.learned.learned_planner import LearnedPlanner
from torc.testing.contexts import cluttered_context


def written(evidence):
    return Evidence.from_plain(json.loads(json.dumps(evidence.to_plain(), allow_nan=False)))


@pytest.mark.parametrize("planner", [DgSelectPlanner, BeliefPlanner, LearnedPlanner])
@pytest.mark.parametrize("hidden", [True, False])
def test_what_planners_leave_is_read_as_it_was_written(planner, hidden):
    context = cluttered_context(9, seed=3, hidden_target=hidden)
    evidence = planner().decide(context, np.random.default_rng(0)).evidence
    assert evidence != Evidence()
    assert written(evidence) == evidence


def test_what_a_model_was_asked_is_read_as_it_was_written():
    tries = (ModelTry("no object", "complete", "m-1", Tokens(3, 4)), ModelTry(None, "complete", "m-1"))
    asked = ModelEvidence(
        "mine", "ab12", "You are a robot.", ({"user": "?", "reply": "1"},), "cd34", (), tries
    )
    evidence = Evidence("fixed", vlm=asked, corrections=Corrections(("1 below 2",), ()), notes={"k": [1]})
    assert written(evidence) == evidence
    assert written(Evidence(corrections=Corrections())).corrections == Corrections()


@pytest.mark.parametrize(
    "plain",
    [
        {"graph": [1, 2], "probabilities": "none", "certainty": {}, "belief": 3, "vlm": {"tries": "no"}},
        {"graph": {"version": 99}, "belief": {"order": "?"}, "rule": 7, "corrections": []},
    ],
)
def test_what_cannot_be_read_stays_as_a_note(plain):
    assert Evidence.from_plain(plain) == Evidence(notes=plain)


def test_a_log_of_version_0_1_is_read():
    plain = {
        "rule": "search",
        "belief": {
            "order": [3, 1],
            "expected_picks": 2.5,
            "reveals": {"3": 0.4},
            "tile_px": 8,
            "tiles": [[1, 2, 0.5]],
        },
        "probabilities": {"1": 0.25},
        "by_graph_because": "too few places",
    }
    belief = BeliefEvidence((3, 1), 2.5, reveals={3: 0.4}, tile_px=8, tiles=((1, 2, 0.5),))
    assert Evidence.from_plain(plain) == Evidence(
        "search", probabilities={1: 0.25}, belief=belief, notes={"by_graph_because": "too few places"}
    )
