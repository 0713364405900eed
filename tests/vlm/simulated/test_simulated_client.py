"""The simulated VLM passes through the prompts and parsers of the real ones, and says what it is."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from situations import HIDDEN, random_situation

from tests.helpers.fake_vlm import ScriptedVlm
from torc.errors import InputError, UnknownNameError
from torc.pipeline.planners import open_client
from torc.records.graph import DependencyEdge, EdgeKind
from torc.task_planning.relations import behind_candidates, find_adjacencies
from torc.testing import contexts
from torc.testing.vlm_client_conformance import check_client
from torc.vlm.answers import (
    PLAN_SCHEMA,
    RELATIONS_SCHEMA,
    Corrected,
    Useless,
    read_corrections,
    read_first_pick,
)
from torc.vlm.asker import fill_prompt
from torc.vlm.config import VlmConfig
from torc.vlm.planners import VlmFixesDgPlanner, VlmGraspsPlanner, VlmSelectPlanner
from torc.vlm.protocol import Finish, Question
from torc.vlm.question_facts import grasp_facts
from torc.vlm.simulated.client import (
    SimulatedVlm,
    ToldFacts,
    candidate_pairs,
    confused,
    draw_luck,
    told_facts,
)
from torc.vlm.simulated.profiles import PROFILES, Profile, find_profile, profile_of_accuracy

PAIRS = ((0, 1), (3, 4), (1, 2), (3, 1))


def simulated(profile, situation=HIDDEN):
    return SimulatedVlm(find_profile(profile) if isinstance(profile, str) else profile, lambda: situation)


def plan_question(repeat=0, facts=""):
    prompt = fill_prompt("vlm-grasps-1" if facts else "vlm-select-1", target=0, target_state="", facts=facts)
    return Question(prompt, (), PLAN_SCHEMA, repeat)


def relations_question(repeat=0):
    lines = [f'{{"source": {s}, "relation": "behind", "target": {t}}}' for s, t in PAIRS]
    prompt = fill_prompt("vlm-fixes-dg-1", target=0, target_state="", relations=",\n".join(lines))
    return Question(prompt, (), RELATIONS_SCHEMA, repeat)


def test_the_perfect_one_names_what_follows_from_the_truth(rng):
    for _ in range(100):
        situation = random_situation(rng)
        order = situation.removal_order()
        if set(order) <= situation.in_sight.keys() and order:
            reply = simulated("perfect", situation).ask(plan_question(int(rng.integers(2**31))))
            picked = read_first_pick(reply, situation.in_sight)
            seen = {*situation.in_sight}
            if all({*p} <= {*seen, 0} for p in (*situation.lies_on, *situation.hides, *situation.blocks)):
                assert picked == order[0]


def test_the_perfect_one_corrects_each_pair_as_it_is():
    candidates = [DependencyEdge(s, t, EdgeKind.BEHIND) for s, t in PAIRS]
    corrected = read_corrections(simulated("perfect").ask(relations_question()), candidates)
    assert [(r.source, r.kind.value, r.target) for r in corrected.relations] == [
        (0, "behind", 1),  # 1 hides 0
        (3, "behind", 4),  # 4 hides 3
        (1, "below", 2),  # 2 lies on 1
        (3, "behind", 1),  # 1 blocks grasps of 3
    ]
    free = replace(HIDDEN, hides={}, blocks=frozenset(), lies_on=frozenset({(1, 2)}))
    corrected = read_corrections(simulated("perfect", free).ask(relations_question()), candidates)
    assert [(r.source, r.kind.value, r.target) for r in corrected.relations] == [(2, "below", 1)]
    assert corrected.refused == ()


@pytest.mark.parametrize("question", [plan_question(7), relations_question(7)])
def test_a_question_decides_its_answer_and_another_repetition_asks_anew(question):
    texts = {simulated("hopeless").ask(question).text for _ in range(3)}
    assert len(texts) == 1
    others = {simulated("hopeless").ask(replace(question, repeat=r)).text for r in range(12)}
    assert len(others) > 8


def test_malformed_replies_are_of_no_use_and_come_in_all_forms():
    spoiling = replace(PROFILES["perfect"], malformed=1.0)
    replies = [simulated(spoiling).ask(plan_question(r)) for r in range(60)]
    assert {reply.finish for reply in replies} == set(Finish)
    assert all(isinstance(read_first_pick(reply, HIDDEN.in_sight), Useless) for reply in replies)
    some = [simulated(replace(spoiling, malformed=0.3)).ask(plan_question(r)) for r in range(300)]
    useless = [isinstance(read_first_pick(reply, HIDDEN.in_sight), Useless) for reply in some]
    assert abs(np.mean(useless) - 0.3) < 4 * np.sqrt(0.21 / 300)


def test_made_up_ids_are_not_in_sight_and_pass_nowhere():
    inventive = replace(PROFILES["perfect"], made_up=1.0)
    for r in range(20):
        answer = read_first_pick(simulated(inventive).ask(plan_question(r)), HIDDEN.in_sight)
        assert isinstance(answer, Useless)
        assert "not in sight" in answer.reason
        candidates = [DependencyEdge(s, t, EdgeKind.BEHIND) for s, t in PAIRS]
        corrected = read_corrections(simulated(inventive).ask(relations_question(r)), candidates)
        assert isinstance(corrected, Corrected)
        assert len(corrected.refused) == 1


def test_it_reads_in_a_prompt_what_the_planners_write_there():
    context = contexts.cluttered_context(10, seed=5)
    vlm = ScriptedVlm(["?"])
    for planner in (VlmGraspsPlanner(vlm), VlmFixesDgPlanner(vlm), VlmSelectPlanner(vlm)):
        planner.decide(context, np.random.default_rng(0))
    of_grasps, of_relations, of_plan = (q.prompt for q in vlm.questions[::3])
    told = told_facts(of_grasps)
    lines = [f"Object {k} is graspable." for k in told.graspable]
    lines += [f"Object {b} is blocked by object {a}." for a, b in told.blocks]
    assert sorted(lines) == sorted(grasp_facts(context))
    assert told_facts(of_plan) is None
    pairs = [(r.source, r.target) for r in behind_candidates(find_adjacencies(context.scene))]
    assert list(candidate_pairs(of_relations)) == pairs
    assert candidate_pairs(of_plan) == ()


def test_it_does_what_every_client_must():
    check_client(lambda: simulated("paper"))


def test_a_prompt_of_somebody_elses_is_refused():
    with pytest.raises(InputError, match="prompts of vlm-select"):
        simulated("perfect").ask(Question("How many cans?", (), None))


def test_profiles_are_named_or_an_accuracy():
    assert find_profile("0.80") == profile_of_accuracy(0.8, "0.8")
    assert find_profile("paper") is PROFILES["paper"]
    with pytest.raises(UnknownNameError, match="Did you mean 'perfect'"):
        find_profile("perfct")
    for text in ("1.2", "-0.1", "nan"):
        with pytest.raises(InputError, match=r"0 to 1"):
            find_profile(text)


def test_it_takes_a_profile_alone_and_needs_a_truth():
    truth = lambda: HIDDEN  # noqa: E731
    assert open_client(VlmConfig("simulated", "good"), truth=truth).profile.name == "good"
    for options in ({"temperature": 0.5}, {"base_url": "http://host/v1"}):
        with pytest.raises(InputError, match="profile alone"):
            open_client(VlmConfig("simulated", "good", **options), truth=truth)
    with pytest.raises(InputError, match="torc run"):
        open_client(VlmConfig("simulated", "good"))


def test_what_hides_the_target_most_goes_first_but_before_it_what_lies_on_it():
    assert HIDDEN.removal_order() == (2, 1, 0)


def test_a_way_that_leads_nowhere_is_left_for_the_next():
    stuck = replace(HIDDEN, lies_on=frozenset(), graspable=frozenset({4}))
    assert stuck.waits_for(1) == ()  # nobody knows why it cannot be grasped
    assert stuck.removal_order() == (4, 3, 0)


def test_a_free_target_is_picked_at_once():
    seen = replace(HIDDEN, in_sight={0: 200, **HIDDEN.in_sight}, graspable=frozenset({0, 2, 4}))
    assert seen.removal_order() == (0,)
    covered = replace(seen, lies_on=frozenset({(4, 0)}))
    assert covered.removal_order() == (4, 0)


def test_orders_of_any_facts_keep_to_them(rng):
    """Whatever the facts: what is first can be picked, and each other object waits for the one before it."""
    ways = 0
    for _ in range(500):
        situation = random_situation(rng)
        order = situation.removal_order()
        assert len(set(order)) == len(order)
        if order:
            assert order[-1] == 0
        if len(order) > 1 and order[0] in situation.waits_for(order[1]):
            ways += 1
            assert order[0] in situation.graspable
            assert situation.waits_for(order[0]) == ()
            assert all(a in situation.waits_for(b) for a, b in pairwise(order))
        elif situation.graspable:
            assert order[0] in situation.graspable
    assert ways > 60


def facts(situation):
    """All that a situation says, as a set."""
    kinds = {"lies": situation.lies_on, "hides": situation.hides, "blocks": situation.blocks}
    found = {(kind, pair) for kind, pairs in kinds.items() for pair in pairs}
    return found | {("grasp", k) for k in situation.graspable} | {("seen", situation.target_seen)}


def visible_part(situation):
    """What can be said of what is in sight, and of the target."""
    known = {*situation.in_sight, 0}

    def of(pairs):
        return frozenset(p for p in pairs if known >= {*p})

    hides = {p: n for p, n in situation.hides.items() if known >= {*p}}
    return replace(situation, lies_on=of(situation.lies_on), hides=hides, blocks=of(situation.blocks))


def test_the_perfect_one_takes_all_as_it_is(rng):
    for _ in range(50):
        truth = random_situation(rng)
        assert confused(truth, PROFILES["perfect"], draw_luck(rng)) == visible_part(truth)


def test_a_better_one_errs_only_where_a_worse_one_does(rng):
    """About facts that both can be asked: a model that does not see the target is asked what hides it, too."""
    for _ in range(50):
        truth, luck = random_situation(rng), draw_luck(rng)
        wrong = []
        for accuracy in (0.95, 0.8, 0.6, 0.3):
            profile = replace(profile_of_accuracy(accuracy, "some"), sees_target=1.0)
            believed = facts(confused(truth, profile, luck))
            mistakes = believed ^ facts(visible_part(truth))
            # The two directions in which one thing can be thought to lie on another are one mistake.
            wrong.append({(kind, frozenset(p) if kind == "lies" else p) for kind, p in mistakes})
        assert wrong[0] <= wrong[1] <= wrong[2] <= wrong[3]
        assert len(wrong[0]) < len(wrong[3])


def test_facts_are_right_as_often_as_stated(rng):
    profile = Profile(
        "some", 0.9, front=0.6, below=0.8, free=0.7, blocked=0.55, heeds_facts=0, made_up=0, malformed=0
    )
    right = {"seen": [], "front": [], "below": [], "free": [], "blocked": []}
    for _ in range(300):
        truth, luck = random_situation(rng), draw_luck(rng)
        believed = confused(truth, profile, luck)
        right["seen"].append(believed.target_seen == truth.target_seen)
        ids = truth.in_sight.keys() & believed.in_sight.keys()
        for k in ids:
            right["free" if k in truth.graspable else "blocked"].append(
                (k in believed.graspable) == (k in truth.graspable)
            )
        for a, b in ((a, b) for a, b in truth.near if a in ids and b in ids):
            right["blocked" if (a, b) in truth.blocks else "free"].append(
                ((a, b) in believed.blocks) == ((a, b) in truth.blocks)
            )
            right["front"].append(((a, b) in believed.hides) == ((a, b) in truth.hides))
            if not {(a, b), (b, a)} & truth.lies_on:
                right["below"].append(not {(a, b), (b, a)} & believed.lies_on)
    stated = {"seen": 0.9, "front": 0.6, "below": 0.8, "free": 0.7, "blocked": 0.55}
    for kind, found in right.items():
        spread = np.sqrt(stated[kind] * (1 - stated[kind]) / len(found))
        assert abs(np.mean(found) - stated[kind]) < 4 * spread, kind


def test_a_model_that_heeds_what_it_is_told_goes_by_it(rng):
    told = ToldFacts(frozenset({2, 3}), frozenset({(2, 5)}))
    for _ in range(50):
        truth = random_situation(rng)
        profile = replace(profile_of_accuracy(0.3, "some"), heeds_facts=1.0, sees_target=1.0)
        believed = confused(truth, profile, draw_luck(rng), told=told)
        assert believed.graspable == told.graspable & truth.in_sight.keys()
        assert {p for p in believed.blocks if p[1] in truth.in_sight} == told.blocks
        deaf = confused(
            truth, replace(profile, heeds_facts=0.0), draw_luck(np.random.default_rng(1)), told=told
        )
        assert deaf == confused(truth, profile, draw_luck(np.random.default_rng(1)))
