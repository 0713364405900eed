"""The loop's bookkeeping, with real perception, grasps and occlusion on analytic shapes, and a fake robot."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.fake_episode import FakeRobot, ScriptedPlanner, fake_system
from torc.episode.events import Ended, Looked, Started
from torc.episode.loop import Episode, run_episode
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError
from torc.io.record_files import load_record
from torc.perception.protocol import Wanted
from torc.pipeline.planners import make_planner
from torc.pipeline.state import EndReason
from torc.records import Capture, Decision, FeltOutcome, GraspStatus, PickOutcome, PickResult
from torc.testing.synthetic import SyntheticBox
from torc.trials.log import TrialResult, line_of, result_facts, without_seconds
from torc.trials.recorder import TrialRecorder

TALL = SyntheticBox(1, (0.58, -0.12, 1.15), (0.05, 0.14, 0.20))
SIDE = SyntheticBox(2, (0.62, -0.30, 1.10), (0.05, 0.05, 0.10))
TARGET = SyntheticBox(0, (0.66, -0.12, 1.08), (0.05, 0.05, 0.06))


@pytest.fixture
def play(robot):
    def run(planner, shapes=(TARGET, TALL, SIDE), results=(), impossible=(), max_picks=5, listeners=()):
        hardware = FakeRobot(robot, shapes, results)
        system, config = fake_system(hardware, impossible=impossible), EpisodeConfig(max_picks)
        episode = Episode(hardware, system, Wanted("the box"), config, listeners)
        return run_episode(episode, planner, Started("test", planner.name, 0, "the box", max_picks))

    return run


def test_hidden_target_is_found_and_retrieved(play):
    result = play(make_planner("dg-select"))
    assert result.retrieved
    assert result.end is EndReason.RETRIEVED
    assert [o.object_id for o in result.outcomes] == [1, 0]
    assert result.outcomes[0].result is PickResult.REMOVED


def test_lost_picks_have_their_own_names(play):
    result = play(ScriptedPlanner([7, None, 1]), impossible=[1], max_picks=3)
    assert [o.result for o in result.outcomes] == [PickResult.NO_VALID_CHOICE] * 2 + [PickResult.NO_PLAN]
    assert result.outcomes[0].detail == "Object 7 is not in sight; 1, 2 are."


def test_episode_ends_when_the_target_falls_or_nothing_is_left(play):
    lost = PickOutcome(PickResult.MISSED, 1, target_lost=True, duration_s=4.0)
    assert play(ScriptedPlanner([1]), results=[lost]).end is EndReason.TARGET_LOST
    assert play(ScriptedPlanner([2]), shapes=(SIDE,)).end is EndReason.NOTHING_LEFT


def test_giving_up_is_no_attempt(play):
    class Quitter(ScriptedPlanner):
        def decide(self, context, rng):
            return Decision(None, "hopeless", give_up=True)

    result = play(Quitter([]))
    assert (result.end, result.picks) == (EndReason.GAVE_UP, 0)


def test_log_is_json_and_the_same_again(play):
    logs = []
    for _ in range(2):
        events = []
        play(make_planner("random"), listeners=[events.append])
        assert isinstance(events[0], Started)
        assert isinstance(events[-1], Ended)
        logs.append([json.dumps(without_seconds(line_of(e).plain)) for e in events])
    assert logs[0] == logs[1]


def test_saved_snapshots_give_the_same_perception_again(play, tmp_path):
    """The record is what perception was given, also what planners are not shown."""
    recorder, seen = TrialRecorder(tmp_path / "trial", {}, snapshots=True), []
    play(make_planner("random"), max_picks=1, listeners=[recorder, seen.append])
    recorder.complete(TrialResult(status="completed"))
    record = load_record(tmp_path / "trial" / "picks" / "00_observation.npz", Capture)
    (capture,) = seen[1].look.captures
    assert np.array_equal(record.observation.depth_m, capture.observation.depth_m)
    assert np.array_equal(record.label_image, capture.label_image)


def test_recorder_writes_a_whole_directory(play, tmp_path):
    recorder = TrialRecorder(tmp_path / "trial", {"planner": "dg-select"}, snapshots=True)
    result = play(make_planner("dg-select"), listeners=[recorder])
    assert (tmp_path / "trial.partial").exists()
    assert not (tmp_path / "trial").exists()
    recorder.complete(TrialResult(status="completed", **result_facts(result)))
    names = {
        p.relative_to(tmp_path / "trial").as_posix() for p in (tmp_path / "trial").rglob("*") if p.is_file()
    }
    assert {"spec.json", "result.json", "events.jsonl", "strip.png", "picks/00_seen.png"} <= names
    assert {"picks/00_graph.png", "picks/00_observation.npz", "picks/01_seen.png"} <= names
    assert not (tmp_path / "trial.partial").exists()
    with pytest.raises(InputError, match="--overwrite"):
        TrialRecorder(tmp_path / "trial", {})


def test_planners_see_nothing_privileged_in_the_history(play):
    seen = []

    class Spy(ScriptedPlanner):
        def decide(self, context, rng):
            seen.append(context.history)
            return super().decide(context, rng)

    told = PickOutcome(PickResult.STOPPED, 1, 0, dropped=(2,), detail="finger on object 0", duration_s=4.0)
    play(Spy([1, 1]), results=[told], max_picks=2)
    assert seen[1] == (PickOutcome(PickResult.STOPPED, 1, duration_s=4.0),)


def test_planners_and_the_memory_of_failures_go_by_what_was_felt_and_scores_by_what_was(play):
    """What happened is the same twice; the robot noticed it only once."""
    seen = []

    class Spy(ScriptedPlanner):
        def decide(self, context, rng):
            seen.append((context.history, context.grasps.scores))
            return super().decide(context, rng)

    slipped = PickOutcome(PickResult.SLIPPED, 1, 1, held_after_lift=True)
    believed = FeltOutcome(PickResult.REMOVED, True, True)
    for told in (slipped, replace(slipped, felt=believed)):
        ended = play(Spy([1, 1]), results=[told], max_picks=2)
        assert ended.outcomes[0].result is PickResult.SLIPPED
    play(Spy([1, 1]), results=[PickOutcome(PickResult.REMOVED, 1, 1, True, True)], max_picks=2)
    _, (noticed, lowered), _, (unnoticed, untouched), _, (_, after_success) = seen
    assert [h.result for h in (*noticed, *unnoticed)] == [PickResult.SLIPPED, PickResult.REMOVED]
    assert np.any(lowered < untouched)
    assert np.array_equal(untouched, after_success)


@pytest.mark.parametrize(("result", "counts"), [(PickResult.STOPPED, True), (PickResult.NOT_REACHED, False)])
def test_a_grasp_that_was_never_reached_did_not_fail(play, result, counts):
    def second_look(choice):
        scores = []

        def listen(event):
            if isinstance(event, Looked) and event.pick == 1:
                scores.append(event.look.context.grasps.scores)

        told = PickOutcome(result, 1, duration_s=3.0)
        end = play(ScriptedPlanner([choice, 1]), results=[told] * 2, max_picks=2, listeners=[listen])
        return scores[0], result_facts(end)["grasps_executed"]

    after_nothing, _ = second_look(None)  # no choice: nothing was tried
    after_the_attempt, executed = second_look(1)
    assert np.array_equal(after_nothing, after_the_attempt) == (not counts)
    assert executed == (2 if counts else 0)


def test_a_grasp_without_a_motion_is_held_back_until_the_next_motion_and_one_that_was_tried_is_remembered(
    play,
):
    """Object 1 finds no motion, then the robot goes for object 2 in vain, twice; nothing has moved after that."""
    remembered, held_back = [], []

    def listen(event):
        if isinstance(event, Looked):
            remembered.append([(f.object_id, f.executed) for f in event.state.failed])
            held_back.append(np.count_nonzero(event.look.context.report.status == GraspStatus.NO_MOTION))

    told = [PickOutcome(PickResult.SLIPPED, 2, duration_s=3.0)] * 2
    play(ScriptedPlanner([1, 2, 2]), results=told, impossible=[1], max_picks=4, listeners=[listen])
    assert remembered == [[], [(1, False)], [(2, True)], [(2, True), (2, True)]]
    assert held_back[1] > 0
    assert [held_back[k] for k in (0, 2, 3)] == [0, 0, 0]


def test_an_object_without_a_motion_twice_waits_until_something_moved(play):
    """The first plan tries a few grasps, the second a few others; then all of them are held back, and no others'."""
    left = []

    def listen(event):
        if isinstance(event, Looked):
            report = event.look.context.report
            left.append({k: report.has_valid_grasp(k) for k in (1, 2)})

    play(ScriptedPlanner([1, 1, 2, 1]), impossible=[1], max_picks=4, listeners=[listen])
    assert left[1] == {1: True, 2: True}
    assert left[2] == {1: False, 2: True}
    assert left[3][1]
