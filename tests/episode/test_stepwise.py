"""An episode driven by hand: turns, ends, and the same as the loop."""

import pytest

from tests.helpers.fake_episode import FakePlayground
from tests.helpers.fake_trial import SHAPES
from torc.episode.state import EndReason
from torc.episode.steps import EpisodeConfig
from torc.records import Decision, PickResult

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


def test_giving_up_is_no_attempt(begin):
    episode = begin()
    episode.pick(episode.look(), Decision(None, "hopeless", give_up=True))
    assert episode.result().end is EndReason.GAVE_UP
    assert episode.result().picks == 0
