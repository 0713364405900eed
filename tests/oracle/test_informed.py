"""INFORMED takes the order that needs the fewest picks on average, by other draws than the trial's."""

from types import SimpleNamespace

import numpy as np
import pytest

from torc.errors import InputError
from torc.oracle import informed
from torc.oracle.informed import InformedPlanner, picks_of
from torc.pipeline.planners import is_reference
from torc.pipeline.state import EndReason
from torc.records import TARGET_ID, Decision, PickOutcome, PickResult

SHORT, LONG = (1, TARGET_ID), (2, 3, TARGET_ID)
"""Two ways to the target: 1 alone is in the way of it, or 2 and 3 together."""


class Game:
    """A table of four objects: the target can be picked once 1, or 2 and 3, are gone. 1 slips in unlucky draws."""

    def __init__(self, seed=0, slips=lambda seed: False):
        self.seed, self.slips = seed, slips

    def with_draws(self, seed):
        return Game(seed, self.slips)

    def nowhere(self, state, context):
        return False

    def look(self, state):
        free = 1 in state.gone or {2, 3} <= state.gone
        left = tuple(k for k in (1, 2, 3) if k not in state.gone)
        return SimpleNamespace(context=SimpleNamespace(graspable_ids=(TARGET_ID, *left) if free else left))

    def pick(self, state, look, chosen):
        assert chosen in look.context.graspable_ids
        held = not (chosen == 1 and self.slips(self.seed))
        gone = state.gone | ({chosen} if held else set())
        done = chosen == TARGET_ID
        result = PickResult.RETRIEVED if done else PickResult.REMOVED if held else PickResult.SLIPPED
        outcome = PickOutcome(result, chosen, chosen, True, held)
        return _state(gone, (*state.episode.outcomes, outcome), EndReason.RETRIEVED if done else None)


def _state(gone=frozenset(), outcomes=(), end=None):
    episode = SimpleNamespace(outcomes=outcomes, end=end, pick=len(outcomes))
    return SimpleNamespace(gone=frozenset(gone), episode=episode)


@pytest.fixture(autouse=True)
def no_pipeline(monkeypatch):
    """What a look shows is what the game says, and DG-SELECT takes the first object."""
    first = SimpleNamespace(decide=lambda context, rng: Decision(context.graspable_ids[0], ""))
    monkeypatch.setattr(informed, "DgSelectPlanner", lambda: first)
    monkeypatch.setattr(informed, "_order_in", lambda sandbox, *rest: (SHORT, LONG)[sandbox.seed % 2])


def _decide(slips, seed=7, history=()):
    planner = InformedPlanner(searches=8, futures=6)
    game = Game(seed, slips)
    config = SimpleNamespace(max_picks=9, seed=seed)
    planner.attach(SimpleNamespace(sandbox=game, config=config, say=print, now=_state))
    context = SimpleNamespace(graspable_ids=(1, 2, 3), history=history, called=str)
    return planner, planner.decide(context, np.random.default_rng(0))


def test_an_order_takes_as_many_picks_as_it_is_long_where_nothing_fails():
    assert picks_of(SHORT, Game(), _state(), 9) == 2
    assert picks_of(LONG, Game(), _state(), 9) == 3


def test_an_order_that_never_gets_there_takes_all_that_is_left():
    assert picks_of(SHORT, Game(slips=lambda seed: True), _state(), 5) == 5


def test_the_shorter_order_is_taken_where_it_is_safe():
    _, decision = _decide(lambda seed: False)
    assert decision.object_id == 1


def test_the_safer_order_is_taken_where_the_shorter_one_mostly_fails():
    _, decision = _decide(lambda seed: seed % 5 > 0)
    assert decision.object_id == 2


def test_the_trials_own_luck_changes_nothing():
    """1 slips in the trial's own draws alone: who foresaw that would take 2."""
    _, decision = _decide(lambda seed: seed == 7)
    assert decision.object_id == 1


def test_an_order_is_followed_as_long_as_it_goes_well():
    planner, first = _decide(lambda seed: seed % 5 > 0)
    removed = PickOutcome(PickResult.REMOVED, first.object_id, first.object_id, True, True)
    context = SimpleNamespace(graspable_ids=(1, 3), history=(removed,), called=str)
    assert "next in the order" in planner.decide(context, np.random.default_rng(0)).reason


def test_it_needs_a_simulation_and_is_known_as_privileged():
    assert is_reference("informed")
    with pytest.raises(InputError, match="simulated trials only"):
        InformedPlanner().decide(SimpleNamespace(), np.random.default_rng(0))
    with pytest.raises(InputError, match="at least one"):
        InformedPlanner(futures=0)
