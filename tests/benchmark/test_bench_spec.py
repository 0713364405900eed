"""A trial's id follows from what decides its result, and from nothing else."""

from dataclasses import replace

import pytest

from torc.benchmark.identity import problem_fingerprint
from torc.benchmark.spec import (
    BenchPlanner,
    BenchProblem,
    PlannedTrial,
    Settings,
    from_json,
    make_spec,
    merged,
    to_json,
)
from torc.errors import InputError
from torc.robots.names import DEFAULT_ROBOT
from torc.scenes.problem import load_problem
from torc.testing.fake_bench import fake_spec
from torc.vlm.config import VlmConfig

PROBLEM = BenchProblem("structured-01", "structured", "ab12", shipped=True)
VLM = VlmConfig("gemini", "robot-1")
TRIAL = PlannedTrial(PROBLEM, BenchPlanner("vlm-select", VLM), 3, Settings(), "0.1.0")


def test_ids_are_those_of_all_times():
    """Should this fail, stores that people have would be played anew: raise ID_FORMAT if that is meant."""
    assert TRIAL.id == "1b7e9742144b50c3619011437a53c0e7a009bc757c20359f6787111e11608ad1"
    assert TRIAL.directory_name == f"structured-01-vlm-select-robot-1-3-{TRIAL.id[:10]}"


@pytest.mark.parametrize(
    "other",
    [
        replace(TRIAL, seed=4),
        replace(TRIAL, version="0.2.0"),
        replace(TRIAL, problem=replace(PROBLEM, digest="cd34")),
        replace(TRIAL, problem=replace(PROBLEM, name="structured-02")),
        replace(TRIAL, planner=replace(TRIAL.planner, name="vlm-grasps")),
        replace(TRIAL, planner=replace(TRIAL.planner, source="ef56")),
        replace(TRIAL, planner=BenchPlanner("vlm-select", replace(VLM, model="robot-2"))),
        replace(TRIAL, planner=BenchPlanner("vlm-select", replace(VLM, temperature=0.5))),
        replace(TRIAL, planner=BenchPlanner("vlm-select")),
        replace(TRIAL, settings=Settings(noise=True)),
        replace(TRIAL, settings=Settings(max_picks=10)),
        replace(TRIAL, settings=Settings(min_score=0.0)),
        replace(TRIAL, settings=Settings(robot="mine.yaml", robot_source="a1")),
        replace(TRIAL, settings=Settings(grasps="mine:Grasps")),
        replace(TRIAL, settings=Settings(grasps="mine:Grasps", grasps_source="b2")),
    ],
)
def test_what_decides_a_result_changes_the_id(other):
    assert other.id != TRIAL.id


@pytest.mark.parametrize(
    "other",
    [
        replace(TRIAL, planner=BenchPlanner("vlm-select", replace(VLM, timeout_s=5.0, retries=9))),
        replace(TRIAL, planner=BenchPlanner("vlm-select", replace(VLM, base_url=VLM.url))),
        replace(TRIAL, problem=replace(PROBLEM, category="unstructured", shipped=False)),
        replace(TRIAL, settings=Settings(min_score=float(Settings().min_score))),
    ],
)
def test_what_does_not_decide_it_leaves_the_id(other):
    assert other.id == TRIAL.id


def test_a_robot_of_ones_own_is_what_is_in_its_files():
    own = [replace(TRIAL, settings=Settings(robot=f"{where}/mine.yaml", robot_source="a1")) for where in "ab"]
    assert own[0].id == own[1].id


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
    assert from_json(to_json(spec), "here") == spec
    spec = make_spec([PROBLEM], [BenchPlanner("vlm-select", VLM)], range(2), Settings(noise=True), "0.1")
    assert from_json(to_json(spec), "here") == spec


def test_a_spec_that_was_tampered_with_is_refused():
    data = to_json(fake_spec())
    data["trials"][0]["seed"] = 99
    with pytest.raises(InputError, match="changed by hand"):
        from_json(data, "here")
    with pytest.raises(InputError, match="torc-bench/9"):
        from_json({"format": "torc-bench/9"}, "here")
    with pytest.raises(InputError, match="damaged"):
        from_json({"format": "torc-bench/1", "settings": {}, "problems": [], "trials": 3}, "here")


def test_seeds_come_first_so_that_an_unfinished_benchmark_is_balanced():
    cells = [t.cell for t in fake_spec(problems=2, repeats=2).trials]
    assert [seed for _, _, seed in cells] == [0] * 4 + [1] * 4
    assert [planner for planner, _, _ in cells[:2]] == ["random", "dg-select"]


def test_a_robot_that_has_moved_is_the_same_and_one_that_has_changed_is_not():
    def spec(planner, robot, source):
        settings = Settings(robot=robot, robot_source=source)
        return make_spec([PROBLEM], [BenchPlanner(planner)], [0], settings, "0.1")

    both = merged(spec("random", "a/mine.yaml", "a1"), spec("dg-select", "b/mine.yaml", "a1"))
    assert {t.settings.robot for t in both.trials} == {"b/mine.yaml"}
    assert from_json(to_json(both), "here") == both
    with pytest.raises(InputError, match="which has changed since"):
        merged(spec("random", "mine.yaml", "a1"), spec("random", "mine.yaml", "a2"))
    with pytest.raises(InputError, match=f"robot {DEFAULT_ROBOT} there, mine.yaml now"):
        merged(spec("random", DEFAULT_ROBOT, ""), spec("random", "mine.yaml", "a1"))


def test_a_benchmark_grows_and_new_trials_take_the_place_of_old_ones():
    old = fake_spec(("random",))
    both = merged(old, fake_spec(("dg-select",)))
    assert {t.planner.label for t in both.trials} == {"random", "dg-select"}
    changed = replace(old.trials[0], planner=BenchPlanner("random", source="another"))
    again = merged(both, replace(old, trials=(changed,)))
    assert len(again.trials) == len(both.trials)
    assert changed in again.trials
    assert old.trials[0] not in again.trials


def test_what_cannot_be_compared_is_not_put_together():
    with pytest.raises(InputError, match="max_picks 15 there, 7 now"):
        merged(fake_spec(), fake_spec(max_picks=7))
    other = replace(fake_spec().trials[0].problem, digest="another")
    changed = make_spec([other], [BenchPlanner("random")], [0], Settings(), "0.0")
    with pytest.raises(InputError, match="changed since"):
        merged(fake_spec(), changed)


def test_names_must_differ():
    with pytest.raises(InputError, match="More than one planner is called random"):
        fake_spec(("random", "random"))
    with pytest.raises(InputError, match="nothing to play"):
        fake_spec(repeats=0)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"max_picks": 0}, "--max-picks"),
        ({"min_score": 3.0}, "--min-score"),
        ({"min_score": float("nan")}, "--min-score"),
    ],
)
def test_settings_that_no_trial_could_have_are_refused_before_any_is_played(wrong, said):
    with pytest.raises(InputError, match=said):
        Settings(**wrong)
