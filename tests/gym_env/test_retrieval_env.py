"""The environment's promises: spaces, rewards, ends, determinism, and the same picks as a trial."""

import json
import subprocess
import sys

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.helpers.fake_episode import FakeRobot, ScriptedPlanner
from tests.helpers.fake_trial import SHAPES
from torc.errors import InputError, PhysicsError
from torc.gym_env.env import PER_OBJECT, RetrievalEnv, observed, stacked
from torc.occlusion.volume import hidden_volumes_m3
from torc.records import MAX_OBJECTS, PickOutcome, PickResult
from torc.specs.trial import TrialSpec
from torc.task_planning.graph_building import build_dependency_graph
from torc.testing.contexts import box, make_context
from torc.trials.trial import run_trial

HIDER, TARGET, BESIDE, NOBODY = 1, 0, 2, 63


def _same(a, b):
    return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)


def test_a_step_is_a_pick_and_the_target_ends_it(make_env):
    env = make_env(max_picks=4)
    observation, info = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert info["action_mask"][[HIDER, BESIDE]].all()
    assert not env.action_masks()[TARGET]
    observation, reward, terminated, truncated, info = env.step(HIDER)
    assert (reward, terminated, truncated) == (-1.0, False, False)
    assert info["result"] == "removed"
    assert env.action_masks()[TARGET]
    observation, reward, terminated, truncated, info = env.step(TARGET)
    assert env.observation_space.contains(observation)
    assert (reward, terminated, truncated) == (9.0, True, False)
    assert (info["end"], info["is_success"], info["picks"]) == ("retrieved", True, 2)
    with pytest.raises(InputError, match="reset"):
        env.step(HIDER)


def test_a_spent_budget_terminates(make_env):
    env = make_env(max_picks=2)
    env.reset(seed=0)
    assert env.step(NOBODY)[4]["result"] == "no valid choice"
    _, reward, terminated, truncated, info = env.step(NOBODY)
    assert (reward, terminated, truncated) == (-1.0, True, False)
    assert (info["end"], info["is_success"]) == ("budget spent", False)


def test_losing_the_target_saves_no_picks(make_env):
    lost = PickOutcome(PickResult.STOPPED, HIDER, dropped=(BESIDE,), target_lost=True)
    env = make_env(max_picks=5, drop_cost=0.25, results=[[lost]])
    env.reset(seed=0)
    _, reward, terminated, _, info = env.step(HIDER)
    assert terminated
    assert info["end"] == "target lost"
    assert reward == -5.25


def test_broken_physics_truncates_and_says_why(make_env, monkeypatch):
    env = make_env()
    before, _ = env.reset(seed=0)

    def explode(self, plan, is_target=None):
        raise PhysicsError("a body flew away")

    monkeypatch.setattr(FakeRobot, "execute", explode)
    observation, reward, terminated, truncated, info = env.step(HIDER)
    assert (reward, terminated, truncated) == (0.0, False, True)
    assert info["error"] == "a body flew away"
    assert _same(observation, before)
    with pytest.raises(InputError, match="reset"):
        env.step(HIDER)


def test_the_seed_draws_problem_and_episode_and_options_name_them(make_env):
    env = make_env(shapes=SHAPES[2:])
    drawn = [env.reset(seed=7)[1], env.reset()[1], env.reset()[1]]
    named = {"problem": "mine", "episode_seed": 5}
    again = [env.reset(seed=7)[1], env.reset(options=named)[1], env.reset()[1]]
    assert [drawn[0]["problem"], "mine", drawn[2]["problem"]] == [i["problem"] for i in again]
    assert [drawn[0]["episode_seed"], 5, drawn[2]["episode_seed"]] == [i["episode_seed"] for i in again]
    with pytest.raises(InputError, match="at least 0"):
        env.reset(options={"episode_seed": -1})
    with pytest.raises(InputError, match="'problems'"):
        env.reset(options={"problems": "structured-01"})


def test_render_and_image_show_what_the_camera_and_the_planners_see(make_env):
    env = make_env(image=True, render_mode="rgb_array")
    observation, _ = env.reset(seed=0)
    picture = env.render()
    assert picture.shape == observation["image"].shape
    assert not np.array_equal(picture, observation["image"])
    assert make_env().render() is None


def test_bad_arguments_are_said(make_env):
    for settings in ({"render_mode": "human"}, {"max_picks": 0}, {"drop_cost": -1.0}):
        with pytest.raises(InputError):
            make_env(**settings)
    with pytest.raises(InputError, match="no-such"):
        RetrievalEnv("no-such-problem")
    env = make_env()
    with pytest.raises(InputError, match="reset"):
        env.action_masks()
    env.reset(seed=0)
    with pytest.raises(InputError, match="64"):
        env.step(64)


def _run(code):
    command = [sys.executable, "-W", "ignore", "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_gymnasium_finds_it_by_its_name_and_nothing_heavy_is_imported_for_that():
    code = (
        "import sys, torc; print('gymnasium' in sys.modules); import torc.gym_env, gymnasium\n"
        "print(gymnasium.spec('torc/Retrieval-v0').entry_point, 'mujoco' in sys.modules)"
    )
    assert _run(code) == ["False", "torc.gym_env.env:RetrievalEnv", "False"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*we recommend:UserWarning")
def test_gymnasium_accepts_it(make_env):
    check_env(make_env(image=True, render_mode="rgb_array"), skip_render_check=True)


@pytest.mark.slow
def test_the_same_seed_and_picks_go_as_in_a_trial_and_again(tmp_path):
    picks = [2, 60, 8]
    spec = TrialSpec.of("structured-01", "scripted", seed=3, max_picks=len(picks))
    trial = run_trial(spec, tmp_path / "trial", planner=ScriptedPlanner(picks), say=lambda text: None)
    lines = [json.loads(line) for line in (trial.directory / "events.jsonl").read_text().splitlines()]
    env = RetrievalEnv("structured-01", max_picks=len(picks))
    try:
        episodes = [_played(env, picks) for _ in range(2)]
    finally:
        env.close()
    assert all(_same(a, b) for a, b in zip(episodes[0][0], episodes[1][0]))
    assert episodes[0][1] == episodes[1][1] == trial.result.outcomes
    graspable = [np.flatnonzero(o["graspable"]).tolist() for o in episodes[0][0]]
    assert graspable[: len(picks)] == [line["graspable"] for line in lines if line["event"] == "looked"]


def _played(env, picks):
    observations = [env.reset(options={"episode_seed": 3})[0]]
    results = []
    for pick in picks:
        observation, _, _, _, info = env.step(pick)
        observations.append(observation)
        results.append(info["result"])
    return observations, results


@pytest.fixture
def context():
    """Box 1 before the target 0, box 2 beside them."""
    shapes = [
        box(0, 0.70, -0.1, (0.05, 0.05, 0.05)),
        box(1, 0.60, -0.1, (0.05, 0.05, 0.08)),
        box(2, 0.65, 0.1, (0.06, 0.06, 0.1)),
    ]
    history = (PickOutcome(PickResult.MISSED, 2), PickOutcome(PickResult.NO_VALID_CHOICE, -1))
    return make_context(
        shapes, valid={1: 2}, blocked={0: [(1,), (1,)], 2: [(1,)]}, history=history, picks_left=3
    )


def test_flags_shares_and_edges_are_those_of_the_context(context):
    seen = observed(context, max_picks=5)
    ids = list(context.scene.ids)
    assert np.flatnonzero(seen["visible"]).tolist() == ids
    assert np.flatnonzero(seen["graspable"]).tolist() == [1] == np.flatnonzero(seen["best_score"]).tolist()
    assert np.flatnonzero(seen["target"]).tolist() == [0]
    assert seen["blocked"][ids].tolist() == [1.0, 0.0, 1.0]
    assert seen["tried"].nonzero()[0].tolist() == [2]
    assert seen["tried"][2] == pytest.approx(1 / 5)
    assert seen["picks_left"] == pytest.approx(3 / 5)
    unseen = np.count_nonzero(~context.volume.seen) * context.volume.grid.voxel_size_m**3
    assert seen["hidden_volume"][ids] * unseen == pytest.approx(hidden_volumes_m3(context.volume, ids))
    weights = build_dependency_graph(context).weight_matrix()
    assert seen["edges"][np.ix_(ids, ids)] == pytest.approx(weights)
    assert seen["edges"].sum() == pytest.approx(weights.sum())


def test_stacked_has_a_row_per_object_and_the_targets_edges_last(context):
    seen = observed(context, 5)
    rows = stacked(seen)
    assert rows.shape == (MAX_OBJECTS, len(PER_OBJECT) + 3)
    assert np.array_equal(rows[:, -1], seen["edges"][0])
    assert np.array_equal(rows[:, 0], seen["visible"])
