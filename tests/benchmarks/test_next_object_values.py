"""Continuations whose outcomes are drawn, against the closed form."""

import numpy as np
import pytest

from benchmarks import next_object_values
from benchmarks.next_object_values import continued, within
from torc.next_object.making.pricing import Price
from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID
from torc.task_planning.expected_picks import expected_picks


class Looks:
    """Every look holds with the same probability."""

    def __init__(self, p):
        self.p = p

    def context(self, gone):
        return self.p


@pytest.fixture(autouse=True)
def by_look(monkeypatch):
    monkeypatch.setattr(next_object_values, "best_hold", lambda context, k: context)


def test_the_mean_of_continuations_is_what_is_expected():
    rng = np.random.default_rng(0)
    picks = [
        continued((3, 5, TARGET_ID), frozenset(), [Looks(0.8), Looks(0.8)], 1000, rng) for _ in range(4000)
    ]
    clearing = 2 * expected_picks(0.8, 0.0, 1000)
    wanted = clearing + expected_picks(0.8, BetConfig().lost_share, 1000)
    # A lost target costs all 1,000 here, those that were spent before included.
    lost = BetConfig().lost_share * 0.2 / (0.8 + BetConfig().lost_share * 0.2)
    assert np.mean(picks) == pytest.approx(wanted - lost * (clearing + 1), rel=0.12)


def test_a_look_without_a_grasp_wastes_a_pick_and_loses_nothing():
    """Half the looks show a sure grasp of the target, the others none."""
    rng, many = np.random.default_rng(0), [Looks(p) for p in (0.0, 1.0, 0.0)]
    picks = [continued((TARGET_ID,), frozenset(), many, 1000, rng) for _ in range(2000)]
    assert np.mean(picks) == pytest.approx(1 + 2.0, abs=0.15)


def test_picks_end_with_the_budget():
    rng = np.random.default_rng(0)
    assert continued((3, TARGET_ID), frozenset(), [Looks(0.0), Looks(0.0)], 6, rng) == 6.0


def test_a_value_that_is_off_is_found():
    picks = np.array([2.0, 3.0] * 25)
    assert within(Price(2.5, 2.4, 2.6), picks)
    assert within(Price(2.3, 2.2, 2.4), picks)
    assert not within(Price(2.0, 1.9, 2.1), picks)
    assert not within(Price(3.0, 2.9, 3.1), picks)
