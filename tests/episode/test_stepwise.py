"""An episode driven by hand: turns, ends, and the same as the loop."""

import pytest

from tests.helpers.fake_episode import FakePlayground
from tests.helpers.fake_trial import SHAPES
from torc.episode.state import EndReason
from torc.episode.steps import EpisodeConfig
from torc.records import Decision, PickOutcome, PickResult

HIDER, TARGET = Decision(1, "it hides the target"), Decision(0, "the target")


@pytest.fixture
def begin(robot):
    def at(max_picks=5, results=()):
        return FakePlayground(robot, SHAPES, [results]).begin("any", EpisodeConfig(max_picks))

    return at


def test_look_and_pick_take_turns_until_the_target_is_out(begin):
    episode = begin()
    for decision in (HIDER, TARGET):
        look = episode.look()
        assert look is not None
        assert episode.end is None
        episode.pick(look, decision)
    assert episode.end is EndReason.RETRIEVED
    assert episode.look() is None
    assert [o.result for o in episode.result().outcomes] == [PickResult.REMOVED, PickResult.RETRIEVED]


def test_the_budget_ends_it_when_the_next_look_is_asked_for(begin):
    episode = begin(max_picks=1)
    episode.pick(episode.look(), Decision(None, "nothing"))
    assert episode.look() is None
    assert episode.end is EndReason.BUDGET_SPENT


def test_giving_up_is_no_attempt(begin):
    episode = begin()
    episode.pick(episode.look(), Decision(None, "hopeless", give_up=True))
    assert episode.result().end is EndReason.GAVE_UP
    assert episode.result().picks == 0


def test_a_lost_target_ends_it(begin):
    episode = begin(results=[PickOutcome(PickResult.STOPPED, 1, target_lost=True)])
    episode.pick(episode.look(), HIDER)
    assert episode.end is EndReason.TARGET_LOST


def test_there_is_no_result_before_the_end(begin):
    with pytest.raises(ValueError, match="not ended"):
        begin().result()
