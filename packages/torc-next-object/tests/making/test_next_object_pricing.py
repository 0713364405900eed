"""What a pick takes, against the closed form and against draws."""

from types import SimpleNamespace

import numpy as np
import pytest

from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID
from torc.task_planning.belief.costs import expected_picks
from torc_next_object.making import pricing
from torc_next_object.making.pricing import CALIBRATION_ERROR, Price, Try, first_tries, price_of

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


def test_a_first_try_leads_on_or_back_or_loses_the_target():
    after, otherwise = Price(2.0, 1.8, 2.3), Price(3.0, 2.9, 3.1)
    assert Try(1.0).then(after, otherwise).mean == 3.0
    assert Try(0.25).then(after, otherwise).mean == 1 + 0.25 * 2.0 + 0.75 * 3.0
    lost = Try(0.6, 0.15, 12).then(Price(), otherwise)
    assert lost.mean == pytest.approx(1 + 0.4 * (0.85 * 3.0 + 0.15 * 12))
    for after in (Price(2.0, 2.0, 2.0), Price(4.0, 4.0, 4.0)):
        price = Try(0.5).then(after, Price(3.0, 3.0, 3.0))
        assert price.high - price.mean == pytest.approx(CALIBRATION_ERROR)
        assert price.mean - price.low == pytest.approx(CALIBRATION_ERROR)


def test_only_a_failed_try_at_the_target_may_lose_it(monkeypatch):
    context = SimpleNamespace(picks_left=11)
    monkeypatch.setattr(pricing, "options_of", lambda _: SimpleNamespace(choices=(TARGET_ID, 3, None)))
    monkeypatch.setattr(pricing, "best_hold", lambda _, k: {3: 0.9, TARGET_ID: 0.8}[k])
    assert first_tries(context) == {TARGET_ID: Try(0.8, LOST, 11), 3: Try(0.9, 0.0, 11)}
