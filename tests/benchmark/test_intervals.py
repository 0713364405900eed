"""Intervals against scipy where it has the same, and against what they must say in simple cases."""

import numpy as np
import pytest
from scipy import stats

from torc.benchmark.comparison import holm, sign_flip_p
from torc.benchmark.intervals import difference, mean, median, share, wilson


@pytest.mark.parametrize(("hits", "trials"), [(0, 12), (3, 12), (50, 60), (60, 60)])
def test_wilson_is_that_of_scipy(hits, trials):
    expected = stats.binomtest(hits, trials).proportion_ci(method="wilson")
    found = wilson(hits / trials, trials, stats.norm.ppf(0.975))
    assert found == pytest.approx((expected.low, expected.high))


def test_differences_of_single_trials_are_those_of_a_t_test(rng):
    gaps = rng.normal(0.4, 2.0, 17)
    expected = stats.ttest_1samp(gaps, 0.0).confidence_interval()
    found = difference(gaps, np.ones(17))
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high))


def test_the_sign_flip_test_is_that_of_scipy(rng):
    gaps = rng.normal(0.5, 1.0, 9)
    expected = stats.permutation_test(
        (gaps,), lambda x, axis: x.sum(axis=axis), permutation_type="samples", n_resamples=np.inf
    )
    assert sign_flip_p(gaps) == pytest.approx(expected.pvalue)
    many = np.concatenate([gaps, rng.normal(0.2, 1.0, 25)])
    large = stats.permutation_test(
        (many,), lambda x, axis: x.sum(axis=axis), permutation_type="samples", n_resamples=20_000, rng=rng
    )
    assert sign_flip_p(many) == pytest.approx(large.pvalue, abs=0.015)


def test_without_any_difference_there_is_nothing_to_find():
    assert sign_flip_p(np.zeros(5)) == 1.0
    assert sign_flip_p(np.ones(14)) == 2 / 2**14
    assert np.isnan(sign_flip_p(np.zeros(0)))


def test_holm_corrects_for_the_number_of_tests():
    # By hand: 3 x .01, 2 x .02, 1 x .03 never below the one before.
    assert holm([0.02, 0.01, 0.03]) == pytest.approx([0.04, 0.03, 0.04])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert np.isnan(holm([float("nan"), 0.01])[0])
    assert holm([float("nan"), 0.01])[1] == 0.01


def test_trials_of_a_problem_that_are_alike_tell_no_more_than_one():
    hits = np.array([0.0, 1, 1, 0, 1, 1, 1, 0, 1, 1])
    one, ten = share(hits, np.ones(10)), share(10 * hits, np.full(10, 10.0))
    assert (ten.value, ten.low, ten.high) == pytest.approx((one.value, one.low, one.high), rel=0.03)
    assert (ten.count, ten.problems) == (100, 10)


def test_never_a_width_of_zero_where_something_may_have_been_missed():
    totals = np.full(20, 5.0)
    sure = share(totals, totals)
    assert (sure.value, sure.high) == (1.0, 1.0)
    assert 0.8 < sure.low < 0.9
    none = mean(np.zeros(20), totals)
    assert none.low == 0.0
    assert 0.1 < none.high < 0.3
    alike = mean(np.full(20, 15.0), totals, largest=15.0)
    assert 2.0 < alike.low < 3.0 == alike.value < 3.5 < alike.high < 6.0
    same = difference(np.zeros(20), totals, largest=1.0)
    assert same.low < -0.1 < 0.1 < same.high
    assert difference(np.zeros(20), totals).high == np.inf


def test_one_problem_tells_nothing_of_others():
    one = np.array([4.0])
    assert (share(np.array([3.0]), one).low, share(np.array([3.0]), one).high) != (0.75, 0.75)
    assert mean(np.array([9.0]), one).high == np.inf
    assert difference(np.array([1.0]), one).low == -np.inf
    assert median(["a"] * 4, [1.0, 2, 3, 4]).high == np.inf


def test_nothing_to_count_is_nothing():
    for found in (share(np.zeros(3), np.zeros(3)), mean(np.zeros(0), np.zeros(0)), median([], [])):
        assert np.isnan(found.value)
        assert found.text() == ""


def test_without_skewness_a_mean_has_the_interval_of_a_t_test(rng):
    half = rng.uniform(1.0, 3.0, 8)
    values = np.concatenate([5 + half, 5 - half])
    expected = stats.ttest_1samp(values, 0.0).confidence_interval()
    found = mean(values, np.ones(16))
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high))
