"""A trial's id follows from what decides its result, and from nothing else."""

import json
from dataclasses import replace

import pytest

from tests.helpers.fake_bench import fake_spec
from torc.benchmark.spec import (
    Around,
    BenchPlanner,
    BenchProblem,
    make_spec,
    merged,
    planned,
    problem_fingerprint,
    vlm_facts,
)
from torc.benchmark.store import from_json, to_json
from torc.errors import InputError
from torc.problems.problem import load_problem
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec
from torc.vlm.config import VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.prices import Prices
from torc.vlm.prompt import Prompt

PROBLEM = BenchProblem("structured-01", "structured", "ab12", shipped=True)
VLM = VlmConfig("gemini", "robot-1")
RANDOM = BenchPlanner(PlannerSpec("random"))


def trial(problem=PROBLEM, planner="vlm-select", vlm=VLM, seed=3, version="0.1.0", source="", **around):
    sources = around.pop("sources", {})
    settings = around.pop("planner_settings", {})
    who = BenchPlanner(PlannerSpec(planner, vlm, settings), source)
    return planned(problem, who, seed, Around(Conditions(**around), sources), version)


def test_ids_are_those_of_all_times():
    """Should this fail, stores that people have would be played anew: raise ID_FORMAT if that is meant."""
    assert trial().id == "bd61dfe6d72db16c85b60b5b83b14bd45f4f77050122a754e2ecd59149674419"
    assert trial().directory_name == f"structured-01-vlm-select-robot-1-3-{trial().id[:10]}"


@pytest.mark.parametrize(
    "other",
    [
        {"seed": 4},
        {"version": "0.2.0"},
        {"problem": replace(PROBLEM, digest="cd34")},
        {"problem": replace(PROBLEM, name="structured-02")},
        {"planner": "vlm-grasps"},
        {"planner_settings": {"asks": 2}},
        {"source": "ef56"},
        {"vlm": replace(VLM, model="robot-2")},
        {"vlm": replace(VLM, temperature=0.5)},
        {"vlm": None},
        {"noise": True},
        {"max_picks": 10},
        {"min_score": 0.0},
        {"perception": "mine:Eyes"},
        {"settings": {"occlusion.smooth_px": 3}},
        {"robot": "mine.yaml", "sources": {"robot": "a1"}},
        {"grasps": "mine:Grasps"},
        {"grasps": "mine:Grasps", "sources": {"grasps": "b2"}},
    ],
)
def test_what_decides_a_result_changes_the_id(other):
    assert trial(**other).id != trial().id


@pytest.mark.parametrize(
    "other",
    [
        {"vlm": replace(VLM, timeout_s=5.0, retries=9)},
        {"vlm": replace(VLM, base_url=VLM.url)},
        {"problem": replace(PROBLEM, category="unstructured", shipped=False)},
        {"min_score": float(Conditions().min_score)},
    ],
)
def test_what_does_not_decide_it_leaves_the_id(other):
    assert trial(**other).id == trial().id


def test_a_problem_is_what_lies_where_and_what_is_said_of_the_target():
    problem = load_problem("structured-04")
    digest = problem_fingerprint(problem)
    assert problem_fingerprint(replace(problem, notes="other words", origin={"seed": 1})) == digest
    assert problem_fingerprint(replace(problem, description="the thing")) != digest
    assert problem_fingerprint(replace(problem, objects=problem.objects[::-1])) != digest
    moved = replace(problem.objects[0], position=(0.7, 0.0, 1.2))
    assert problem_fingerprint(replace(problem, objects=(moved, *problem.objects[1:]))) != digest


def test_a_spec_survives_the_disk():
    spec = fake_spec()
    assert from_json(to_json(spec)) == spec
    asking = BenchPlanner(PlannerSpec("vlm-select", VLM, {"asks": 2}), "ab", {"occlusion.smooth_px": 3})
    spec = make_spec([PROBLEM], [asking, RANDOM], range(2), Around(Conditions(noise=True)), "0.1")
    assert from_json(json.loads(json.dumps(to_json(spec)))) == spec


def test_a_robot_that_has_moved_is_the_same_and_one_that_has_changed_is_not():
    def spec(planner, robot, source):
        around = Around(Conditions(robot=robot), {"robot": source} if source else {})
        return make_spec([PROBLEM], [BenchPlanner(PlannerSpec(planner))], [0], around, "0.1")

    both = merged(spec("random", "a/mine.yaml", "a1"), spec("dg-select", "b/mine.yaml", "a1"))
    assert {t.around.conditions.robot for t in both.trials} == {"b/mine.yaml"}
    assert from_json(to_json(both)) == both
    with pytest.raises(InputError, match="which has changed since"):
        merged(spec("random", "mine.yaml", "a1"), spec("random", "mine.yaml", "a2"))
    with pytest.raises(InputError, match=f"robot {DEFAULT_ROBOT} there, mine.yaml now"):
        merged(spec("random", DEFAULT_ROBOT, ""), spec("random", "mine.yaml", "a1"))


def test_a_benchmark_grows_and_new_trials_take_the_place_of_old_ones():
    old = fake_spec(("random",))
    both = merged(old, fake_spec(("dg-select",)))
    assert {t.planner.label for t in both.trials} == {"random", "dg-select"}
    changed = replace(old.trials[0], planner=replace(RANDOM, source="another"))
    again = merged(both, replace(old, trials=(changed,)))
    assert len(again.trials) == len(both.trials)
    assert changed in again.trials
    assert old.trials[0] not in again.trials


def test_pictures_and_prompts_are_part_of_what_was_played_and_prices_are_not():
    def facts(**options):
        return vlm_facts(VlmConfig("gemini", "m", **options))

    prompt = Prompt("mine", "$target?")
    assert {"picture", "prompt"}.isdisjoint(facts())  # trials of before keep their ids
    assert facts(prices=Prices(1, 2)) == facts()
    assert facts(prompt=prompt)["prompt"] == prompt.digest
    assert facts(picture=PictureConfig("outlines")) != facts() != facts(picture=PictureConfig(plain=True))
