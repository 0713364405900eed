"""What a pick takes, against the closed form and against draws."""

from types import SimpleNamespace

import numpy as np
import pytest

from torc.next_object.making import pricing
from torc.next_object.making.pricing import CALIBRATION_ERROR, Price, first_prices, price_of
from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID
from torc.task_planning.expected_picks import expected_picks

LOST = BetConfig().lost_share


@pytest.mark.parametrize("p", [0.3, 0.8, 1.0])
def test_where_all_draws_agree_only_the_calibration_is_in_doubt(p):
    for is_target, lost in ((False, 0.0), (True, LOST)):
        price = price_of([p] * 4, 12, is_target)
        assert price.mean == pytest.approx(expected_picks(p, lost, 12))
        assert price.high == pytest.approx(expected_picks(p - CALIBRATION_ERROR, lost, 12))
        assert price.low == pytest.approx(expected_picks(min(p + CALIBRATION_ERROR, 1.0), lost, 12))


@pytest.mark.parametrize("holds", [(0.9, 0.0, 0.6), (0.5, 0.5, 0.0, 0.0), (1.0, 0.9)])
@pytest.mark.parametrize("is_target", [False, True])
def test_the_price_is_the_mean_over_draws(holds, is_target):
    rng, left, total, count = np.random.default_rng(0), 9, 0.0, 20_000
    for _ in range(count):
        while True:
            total += 1
            p = holds[rng.integers(len(holds))]
            if rng.random() < p:
                break
            if is_target and p > 0 and rng.random() < LOST:
                total += left
                break
    assert price_of(holds, left, is_target).mean == pytest.approx(total / count, rel=0.02)


def test_the_interval_allows_for_how_few_draws_there_are():
    few, many = price_of([1.0, 0.0], 15), price_of([1.0, 0.0] * 20, 15)
    assert few.mean == many.mean == 2.0
    assert few.low < many.low < 2.0 < many.high < few.high
    error = CALIBRATION_ERROR + 1.96 * np.std([1.0, 0.0] * 20, ddof=1) / np.sqrt(40)
    assert many.high == pytest.approx(1 / (0.5 - error))


def test_no_price_is_more_than_a_whole_trial():
    assert price_of([0.0, 0.01], 15).mean == 15.0
    assert price_of([0.01, 0.01], 15, True).high == 15.0


def test_the_first_try_is_known_and_further_ones_are_not(monkeypatch):
    context = SimpleNamespace(picks_left=15)
    holds = {3: 0.9, 5: 0.5, TARGET_ID: 0.8}
    monkeypatch.setattr(pricing, "options_of", lambda _: SimpleNamespace(choices=(TARGET_ID, 3, 5, None)))
    monkeypatch.setattr(pricing, "best_hold", lambda _, k: holds[k])
    again = {3: Price(2.0, 1.9, 2.1), TARGET_ID: Price(1.5, 1.4, 1.6)}
    found = first_prices(context, again)
    # Object 5 has a grasp at this look alone.
    assert found[5].mean == pytest.approx(1 + 0.5 * 15)
    assert found[3].mean == pytest.approx(1 + 0.1 * 2.0)
    assert found[TARGET_ID].mean == pytest.approx(1 + 0.2 * (0.85 * 1.5 + 0.15 * 15))
    assert all(p.low <= p.mean <= p.high for p in found.values())
