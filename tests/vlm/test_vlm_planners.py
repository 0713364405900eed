"""VLM-SELECT, VLM+GRASPS and VLM-FIXES-DG, the model's part played by a script."""

import json

import numpy as np
import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from torc.errors import InputError
from torc.pipeline.planners import make_planner
from torc.records import Corrections
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.relations import behind_candidates, find_adjacencies
from torc.testing import contexts
from torc.testing.planner_conformance import CASES, check_case
from torc.vlm.planners import VlmFixesDgPlanner, VlmGraspsPlanner, VlmSelectPlanner
from torc.vlm.question_facts import grasp_facts

NAMES = ("vlm-select", "vlm-grasps", "vlm-fixes-dg")


def first(*ids):
    return json.dumps({"thoughts": "so", "plan": [{"action": "remove", "input": i} for i in ids]})


def relations(*entries):
    return json.dumps([{"source": s, "relation": r, "target": t} for s, r, t in entries])


def decide(planner, context, seed=0):
    return planner.decide(context, np.random.default_rng(seed))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("text", ["no idea", first(1)])
def test_they_conform_whatever_the_model_says(name, case, text):
    check_case(lambda: make_planner(name, client=ScriptedVlm([text])), case)


@pytest.mark.parametrize("name", NAMES)
def test_without_a_model_they_say_how_to_name_one(name):
    with pytest.raises(InputError, match=r"--vlm gemini:MODEL"):
        make_planner(name)


def test_the_first_object_of_the_plan_is_picked():
    vlm = ScriptedVlm([first(1, 0)])
    decision = decide(VlmSelectPlanner(vlm), contexts.behind_context())
    assert (decision.object_id, decision.attempts) == (1, 1)
    (question,) = vlm.questions
    (exchange,) = decision.exchanges
    assert (exchange.prompt, exchange.reply) == (question.prompt, vlm.texts[0])


def test_the_model_is_asked_again_for_what_is_not_graspable_or_not_there():
    vlm = ScriptedVlm([first(0), first(9), first(2)])
    decision = decide(VlmSelectPlanner(vlm), contexts.behind_context())
    assert (decision.object_id, decision.attempts) == (2, 3)
    useless = [t.useless for t in decision.evidence.vlm.tries]
    assert "no valid grasp" in useless[0]
    assert "not in sight" in useless[1]
    assert useless[2] is None
    assert len({q.prompt for q in vlm.questions}) == 1


@pytest.mark.parametrize("name", NAMES)
def test_three_useless_answers_lose_the_pick(name):
    vlm = ScriptedVlm(["Sorry?"])
    decision = decide(make_planner(name, client=vlm), contexts.behind_context())
    assert decision.object_id is None
    assert not decision.give_up
    assert decision.attempts == len(vlm.questions) == len(decision.exchanges) == 3
    assert "3 tries" in decision.reason


def test_each_asking_is_a_repetition_of_its_own_and_seeds_decide_it():
    def repeats(seed):
        vlm = ScriptedVlm(["?"])
        decide(VlmSelectPlanner(vlm), contexts.behind_context(), seed)
        return [q.repeat for q in vlm.questions]

    assert repeats(0) == repeats(0)
    assert len({*repeats(0), *repeats(1)}) == 6
    assert all(0 <= r < 2**31 for r in repeats(2))


def test_prompts_say_whether_the_target_is_in_sight():
    for make in (VlmSelectPlanner, VlmGraspsPlanner, VlmFixesDgPlanner):
        for context, words in (
            (contexts.behind_context(), "It is in sight."),
            (contexts.cluttered_context(10, seed=6, hidden_target=True), "It is not in sight"),
        ):
            vlm = ScriptedVlm(["?"])
            decide(make(vlm), context)
            assert words in vlm.questions[0].prompt
            assert "$" not in vlm.questions[0].prompt


def test_only_vlm_grasps_is_told_what_is_graspable():
    context = contexts.behind_context()
    facts = ["Object 0 is blocked by object 1.", "Object 1 is graspable.", "Object 2 is graspable."]
    assert grasp_facts(context) == facts
    for make, told in ((VlmSelectPlanner, False), (VlmGraspsPlanner, True), (VlmFixesDgPlanner, False)):
        vlm = ScriptedVlm(["?"])
        decide(make(vlm), context)
        assert ("\n".join(facts) in vlm.questions[0].prompt) == told


def test_the_example_in_a_prompt_is_no_answer():
    """A model that repeats the form it was shown has answered nothing."""
    for make in (VlmSelectPlanner, VlmGraspsPlanner, VlmFixesDgPlanner):
        vlm = ScriptedVlm(["?"])
        decide(make(vlm), contexts.behind_context())
        echo = ScriptedVlm([vlm.questions[0].prompt.split("for N:")[1]])
        assert decide(make(echo), contexts.behind_context()).object_id is None


def test_relations_left_alone_decide_as_depth_alone_does():
    context = contexts.cluttered_context(10, seed=5)
    candidates = behind_candidates(find_adjacencies(context.scene))
    vlm = ScriptedVlm([relations(*((r.source, r.kind.value, r.target) for r in candidates))])
    decision = decide(VlmFixesDgPlanner(vlm), context)
    assert decision.evidence.corrections == Corrections()
    for r in candidates:
        assert (
            json.dumps({"source": r.source, "relation": "behind", "target": r.target})
            in vlm.questions[0].prompt
        )


def test_corrected_relations_make_the_graph_and_refused_ones_are_named():
    context = contexts.stacked_context()
    (pair,) = behind_candidates(find_adjacencies(context.scene))
    assert {pair.source, pair.target} == {0, 1}
    below = relations((0, "below", 1), (0, "below", 7))
    decision = decide(VlmFixesDgPlanner(ScriptedVlm([below])), context)
    assert decision.object_id == decide(DgSelectPlanner(), context).object_id == 1
    assert decision.evidence.corrections.refused == ("0 below 7: not a pair that was asked about",)
    kinds = {(e.source, e.target): e.kind for e in decision.evidence.graph.edges}
    assert kinds == {(0, 1): "below"}
    assert decide(VlmFixesDgPlanner(ScriptedVlm(["[]"])), context).object_id == 0
