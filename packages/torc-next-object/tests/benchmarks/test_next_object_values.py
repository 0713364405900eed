"""Continuations whose outcomes are drawn, against the closed form."""

import next_object_values
import numpy as np
import pytest
from next_object_values import continued, followed, within

from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID
from torc.task_planning.belief.costs import expected_picks
from torc_next_object.making.pricing import Price
from torc_next_object.making.valuing import Valued


class Looks:
    """Every look holds with the same probability."""

    def __init__(self, p):
        self.p = p

    def context(self, gone):
        return self.p


@pytest.fixture(autouse=True)
def by_look(monkeypatch):
    monkeypatch.setattr(next_object_values, "best_hold", lambda context, k: context)


ANY = frozenset[int]()


def test_the_mean_of_an_order_is_what_is_expected():
    rng = np.random.default_rng(0)
    picks = [followed((3, 5, TARGET_ID), ANY, [Looks(0.8)], 1000, rng) for _ in range(4000)]
    clearing = 2 * expected_picks(0.8, 0.0, 1000)
    wanted = clearing + expected_picks(0.8, BetConfig().lost_share, 1000)
    # A lost target costs all 1,000 here, those that were spent before included.
    lost = BetConfig().lost_share * 0.2 / (0.8 + BetConfig().lost_share * 0.2)
    assert np.mean(picks) == pytest.approx(wanted - lost * (clearing + 1), rel=0.12)


def test_a_look_without_a_grasp_wastes_a_pick_and_loses_nothing():
    """A third of the looks show a sure grasp of the target, the others none."""
    rng, many = np.random.default_rng(0), [Looks(p) for p in (0.0, 1.0, 0.0)]
    picks = [followed((TARGET_ID,), ANY, many, 1000, rng) for _ in range(2000)]
    assert np.mean(picks) == pytest.approx(3.0, abs=0.15)


def test_picks_end_with_the_budget():
    rng = np.random.default_rng(0)
    assert followed((3, TARGET_ID), ANY, [Looks(0.0)], 6, rng) == 6.0


@pytest.mark.parametrize(("p", "wanted"), [(1.0, 2.0), (0.0, 4.0), (0.5, 3.0)])
def test_a_choice_that_fails_is_followed_by_what_is_best(p, wanted):
    valued = Valued({}, {7: (7, TARGET_ID)}, (3, 5, TARGET_ID), 1, True)
    rng = np.random.default_rng(0)
    picks = [continued(valued, 7, ANY, [Looks(p), Looks(1.0)], 15, rng) for _ in range(4000)]
    assert np.mean(picks) == pytest.approx(wanted, abs=0.06)


def test_a_failed_try_at_the_target_may_lose_it():
    valued, rng = Valued({}, {TARGET_ID: (TARGET_ID,)}, (TARGET_ID,), 1, True), np.random.default_rng(0)
    picks = [continued(valued, TARGET_ID, ANY, [Looks(0.0), Looks(1.0)], 15, rng) for _ in range(4000)]
    assert set(picks) == {2.0, 15.0}
    assert np.mean(np.array(picks) == 15.0) == pytest.approx(BetConfig().lost_share, abs=0.02)


def test_a_value_that_is_off_is_found():
    picks = np.array([2.0, 3.0] * 25)
    assert within(Price(2.5, 2.4, 2.6), picks)
    assert within(Price(2.3, 2.2, 2.4), picks)
    assert not within(Price(2.0, 1.9, 2.1), picks)
    assert not within(Price(3.0, 2.9, 3.1), picks)
