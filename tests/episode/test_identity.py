"""Perception's own ids against the simulator's: scored is what really happened, told is what was seen."""

import numpy as np
import pytest

from tests.helpers.fake_episode import FakeRobot, ScriptedPlanner, fake_system
from torc.episode.events import Decided, Executed, Looked, Started
from torc.episode.identity import MaskFaults, mask_faults, true_ids
from torc.episode.loop import Episode, run_episode
from torc.episode.steps import EpisodeConfig
from torc.perception.protocol import Wanted
from torc.pipeline.state import EndReason
from torc.records import Observation, PickOutcome, PickResult
from torc.testing.synthetic import SyntheticBox
from torc.trials.log import line_of

TALL = SyntheticBox(1, (0.58, -0.12, 1.12), (0.05, 0.06, 0.14))
SIDE = SyntheticBox(2, (0.62, -0.30, 1.10), (0.05, 0.05, 0.10))
TARGET = SyntheticBox(0, (0.62, 0.05, 1.08), (0.05, 0.05, 0.06))


@pytest.fixture
def play(robot):
    def run(choices, names=None, targets=(), results=(), in_hand=None):
        """The result, the events, and the eyes; `names` are perception's ids by true ones, `in_hand` what it says of
        each of those in the hand.
        """
        hardware = FakeRobot(robot, (TARGET, TALL, SIDE), results)
        system = fake_system(hardware, names, in_hand)
        events = []
        started = Started("test", "scripted", 0, "the box", 4)
        episode = Episode(hardware, system, Wanted("the box"), EpisodeConfig(4), [events.append])
        result = run_episode(episode, ScriptedPlanner(choices, targets), started)
        return result, events, system.pipeline.perception

    return run


def test_the_truth_of_a_look_is_known_beside_what_eyes_of_ones_own_see(play):
    _, events, eyes = play([7], {0: 7, 1: 4, 2: 5})
    assert {type(seen) for seen in eyes.given} == {Observation}
    look = next(e for e in events if isinstance(e, Looked)).look
    assert not look.ids_given
    assert np.array_equal(look.truth, look.captures[0].label_image)
    assert set(np.unique(look.truth[look.truth >= 0])) == {0, 1, 2}


def test_labels_that_are_given_need_no_translation(play):
    result, events, _ = play([0])
    assert events[1].look.ids_given
    assert events[1].look.truth is None
    assert true_ids(events[1].look) == {}
    assert result.outcomes[0].true_id is None
    lines = [line_of(e).plain for e in events]
    assert not any("true_ids" in line or "true_id" in line for line in lines)


def test_each_mask_is_what_most_of_it_shows(play):
    _, events, _ = play([7], {0: 7, 1: 4, 2: 5})
    look = next(e for e in events if isinstance(e, Looked)).look
    assert true_ids(look) == {7: 0, 4: 1, 5: 2}
    assert line_of(events[1]).plain["true_ids"] == {"7": 0, "4": 1, "5": 2}


def test_two_objects_in_one_mask_are_the_larger_one(play):
    _, events, _ = play([4], {0: 7, 1: 4, 2: 4})
    look = next(e for e in events if isinstance(e, Looked)).look
    truth = look.truth
    larger = 1 if np.count_nonzero(truth == 1) > np.count_nonzero(truth == 2) else 2
    assert true_ids(look) == {7: 0, 4: larger}
    assert mask_faults(look) == MaskFaults(merged=(1, 2))


def test_what_has_no_mask_is_missed_and_nothing_is_wrong_with_true_ones(play):
    _, events, _ = play([7], {0: 7, 1: 4})
    assert mask_faults(events[1].look) == MaskFaults(missed=(2,))
    assert line_of(events[1]).plain["mask_faults"] == {"merged": [], "split": [], "missed": [2]}
    _, events, _ = play([7], {0: 7, 1: 4, 2: 5})
    assert mask_faults(events[1].look) == MaskFaults()
    _, events, _ = play([0])
    assert mask_faults(events[1].look) is None
    assert "mask_faults" not in line_of(events[1]).plain


def test_a_pick_is_told_by_the_ids_that_were_seen_and_scored_by_the_true_ones(play):
    result, events, _ = play([4, 0], {0: 0, 1: 4, 2: 5})
    first, second = result.outcomes
    assert (first.object_id, first.true_id, first.held_id) == (4, 1, 1)
    assert (second.object_id, second.true_id, second.result) == (0, 0, PickResult.RETRIEVED)
    assert result.retrieved
    assert result.held_target
    executed = [line_of(e).plain for e in events if isinstance(e, Executed)]
    assert [line["true_id"] for line in executed] == [1, 0]
    # A planner is told nothing of it.
    assert first.as_felt.true_id is None


def test_another_object_taken_for_the_target_ends_the_episode_unretrieved(play):
    result, _, _ = play([0], {0: 5, 1: 0, 2: 4})
    assert result.end is EndReason.WRONG_OBJECT
    assert not result.retrieved
    assert not result.held_target
    assert result.outcomes[0].wrong_object


def test_a_planner_may_know_the_target_that_perception_does_not(play):
    result, events, _ = play([5], {0: 5, 1: 6, 2: 4}, targets=[5])
    assert result.end is EndReason.RETRIEVED
    assert result.held_target
    (outcome,) = result.outcomes
    assert (outcome.object_id, outcome.true_id, outcome.as_felt.result) == (5, 0, PickResult.RETRIEVED)
    assert [line_of(e).plain.get("is_target") for e in events if isinstance(e, Decided)] == [True]


def test_a_planner_that_takes_another_object_for_the_target_brings_the_wrong_one(play):
    result, _, _ = play([6], {0: 5, 1: 6, 2: 4}, targets=[6])
    assert result.end is EndReason.WRONG_OBJECT


def test_what_a_planner_took_for_the_target_perception_is_told(play):
    missed = PickOutcome(PickResult.MISSED, 5)
    result, _, eyes = play([5, 4], {0: 5, 1: 6, 2: 4}, targets=[5], results=[missed])
    before = eyes.before[1]
    assert before.target_id == 5
    assert before.ids == (4, 5, 6)
    assert result.outcomes[0].object_id == 5


def test_where_true_ids_are_given_what_a_planner_takes_for_the_target_says_nothing(play):
    result, _, _ = play([1, 0], targets=[1])
    assert [o.result for o in result.outcomes] == [PickResult.REMOVED, PickResult.RETRIEVED]
    assert result.outcomes[0].as_felt.result is PickResult.REMOVED


def test_a_target_that_was_brought_unrecognised_is_retrieved_all_the_same(play):
    result, _, _ = play([5], {0: 5, 1: 6, 2: 4})
    assert result.end is EndReason.RETRIEVED
    assert result.outcomes[0].as_felt.result is PickResult.REMOVED


def test_a_neighbour_that_came_up_in_the_targets_place_is_no_mistake_of_the_eyes(play, robot):
    """The mask was right, the grasp was not: as with given labels, the episode goes on."""
    from dataclasses import replace

    result, _, _ = play([0], {0: 0, 1: 4, 2: 5})
    outcome = replace(result.outcomes[0], result=PickResult.REMOVED, held_id=1)
    assert not outcome.wrong_object


def test_what_was_taken_for_the_target_and_is_not_is_let_go(play):
    """The hand knows better than the first look: the episode goes on, and nothing is called the target by habit."""
    result, events, eyes = play([0, 7], {0: 7, 1: 0, 2: 5}, in_hand={0: 0.1, 7: 0.9})
    assert [o.felt.result for o in result.outcomes] == [PickResult.REMOVED, PickResult.RETRIEVED]
    assert [o.target_p for o in result.outcomes] == [0.1, 0.9]
    assert result.end is EndReason.RETRIEVED
    assert eyes.before[1].target_id is None
    assert eyes.before[1].brought_odds == pytest.approx(0.1 / 0.9)
    lines = [line_of(e).plain for e in events if isinstance(e, Executed)]
    assert [line["target_p"] for line in lines] == [0.1, 0.9]


def test_only_what_was_brought_may_be_the_target_in_the_bin(play):
    slipped = PickOutcome(PickResult.SLIPPED, 4, held_after_lift=True)
    result, _, eyes = play([4, 7], {0: 7, 1: 4, 2: 5}, results=[slipped], in_hand={4: 0.5, 7: 0.9})
    assert result.retrieved
    assert result.outcomes[0].target_p == 0.5
    assert eyes.before[1].brought_odds == 0


def test_another_object_that_passes_for_the_target_in_the_hand_ends_the_episode(play):
    result, _, _ = play([4], {0: 7, 1: 4, 2: 5}, in_hand={4: 0.9})
    assert result.end is EndReason.WRONG_OBJECT
    assert not result.retrieved


def test_where_the_hand_cannot_tell_belief_stays(play):
    result, events, _ = play([4, 0], {0: 0, 1: 4, 2: 5}, in_hand={0: None, 4: None})
    assert [o.felt.result for o in result.outcomes] == [PickResult.REMOVED, PickResult.RETRIEVED]
    assert not any("target_p" in line_of(e).plain for e in events)


def test_who_names_the_target_is_not_asked_again(play):
    result, _, _ = play([7], {0: 7, 1: 4, 2: 5}, targets=[7], in_hand={})
    assert result.end is EndReason.RETRIEVED
    assert result.outcomes[0].target_p is None
