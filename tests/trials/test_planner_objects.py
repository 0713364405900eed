"""A planner that is given as an object: what it plays is what is written, and odd answers are lost picks."""

import json

import numpy as np
import pytest

from tests.helpers.fake_trial import play_fake_trial
from torc.errors import InputError
from torc.pipeline.planners import spec_of_object
from torc.records import Decision
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.task_planning.dg_select import DgSelectPlanner
from torc.vlm.config import VlmConfig
from torc.web.session import HumanPlanner, Session


class Mine:
    def __init__(self, name="mine", answer=None):
        self.name, self.answer = name, answer

    def decide(self, context, rng):
        return self.answer


def test_the_planners_own_name_is_written():
    assert spec_of_object(PlannerSpec("dg-select"), Mine()).name == "mine"
    assert spec_of_object(PlannerSpec("mine"), Mine()).name == "mine"


@pytest.mark.parametrize(
    ("name", "planner"),
    [("dg-select", DgSelectPlanner()), ("human", HumanPlanner(Session(), "ann")), ("my.py:Mine", Mine())],
)
def test_a_spec_that_names_the_class_stays(name, planner):
    assert spec_of_object(PlannerSpec(name), planner) == PlannerSpec(name)


@pytest.mark.parametrize(
    ("spec", "planner", "text"),
    [
        (PlannerSpec("dg-select"), Mine("dg-select"), "name of another task planner"),
        (PlannerSpec("mine"), Mine("oracle"), "name of another task planner"),
        (PlannerSpec("dg-select"), Mine(""), "needs a `name`"),
        (PlannerSpec("dg-select"), Mine(None), "needs a `name`"),
        (PlannerSpec("belief", settings={"planner.risk": 1}), Mine(), "do not reach"),
        (PlannerSpec("vlm-select", VlmConfig("openai", "m")), Mine(), "but Mine plays"),
    ],
)
def test_what_would_be_written_wrongly_is_refused(spec, planner, text):
    with pytest.raises(InputError, match=text):
        spec_of_object(spec, planner)


@pytest.mark.parametrize(
    ("number", "logged"), [(99, -1), (-5, -1), (2**70, -1), (np.int64(99), -1), (63, 63), (1, 1)]
)
def test_a_number_that_no_object_can_have_is_no_valid_choice(number, logged, tmp_path):
    answer = Decision(number, "A guess.", attempts=np.int64(1))
    trial = play_fake_trial(TrialSpec.of("boxes", "mine", max_picks=1), tmp_path / "t", Mine(answer=answer))
    lines = [json.loads(line) for line in (tmp_path / "t" / "events.jsonl").read_text().splitlines()]
    executed = next(line for line in lines if line["event"] == "executed")
    assert trial.result.status == "completed"
    assert executed["object_id"] == logged
    if number != 1:
        assert executed["result"] == "no valid choice"
        assert str(number) in executed["detail"]
