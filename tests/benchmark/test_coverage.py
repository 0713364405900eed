"""Intervals contain the truth as often as they claim: 1,000 benchmarks with known truth, 10 to 40 problems.

The problems are alike within and differ between as the paper's do: success rates with an intraclass correlation about
.1 (.06-.16 there), drops and picks with the spread of its table. Allowed is 93-97 %; a share near 1 may be covered
more often, since a share of few trials can only take few values.
"""

import numpy as np
import pytest
from scipy import stats

from torc.benchmark.intervals import difference, holm, mean, median, share, sign_flip_p, wilson

FAST, SLOW = 250, 1000


def _shares(rng, problems, truth, repeats=10, correlation=0.1):
    pull = 1 / correlation - 1
    chances = rng.beta(truth * pull, (1 - truth) * pull, problems)
    return share(rng.binomial(repeats, chances).astype(float), np.full(problems, float(repeats)))


def _grasps(rng, problems, truth):
    totals = 5.0 + rng.poisson(30, problems)
    chances = rng.beta(9 * truth, 9 * (1 - truth), problems)
    return share(rng.binomial(totals.astype(int), chances).astype(float), totals)


def _drops(rng, problems, truth):
    rates = rng.gamma(1.6, truth / 1.6, problems)
    return mean(rng.poisson(10 * rates).astype(float), np.full(problems, 10.0))


def _picks(rng, problems, truth):
    means = 1 + rng.gamma(2.0, (truth - 1) / 2, problems)
    picks = 1 + rng.poisson(np.repeat(means[:, None] - 1, 10, axis=1))
    return mean(picks.sum(axis=1).astype(float), np.full(problems, 10.0))


def _gaps(rng, problems, truth):
    easy = rng.uniform(0.4, 0.8, problems)
    gain = np.clip(truth + rng.normal(0, 0.08, problems), -0.2, 0.2)
    gaps = rng.binomial(10, easy + gain) - rng.binomial(10, easy)
    return difference(gaps.astype(float), np.full(problems, 10.0))


def _times(rng, problems, truth):
    middle = rng.normal(np.log(truth), 0.5, problems)
    values = np.exp(middle[:, None] + rng.normal(0, 0.5, (problems, 10)))
    return median(np.repeat([f"p{i}" for i in range(problems)], 10).tolist(), values.ravel())


CASES = {
    "success .74": (_shares, 0.74),
    "success .85": (_shares, 0.85),
    "success .90": (_shares, 0.90),
    "grasps held .69": (_grasps, 0.69),
    "drops 1.2": (_drops, 1.2),
    "picks 5": (_picks, 5.0),
    "difference of success .05": (_gaps, 0.05),
    "decision time": (_times, 0.01),
}


def _coverage(case, problems, draws):
    draw, truth = CASES[case]
    rng = np.random.default_rng([problems, list(CASES).index(case)])
    found = (draw(rng, problems, truth) for _ in range(draws))
    return np.mean([e.low <= truth <= e.high for e in found])


@pytest.mark.parametrize("case", [c for c in CASES if c != "decision time"])
def test_coverage_in_short(case):
    # The range of chance for so few draws: 95 % +- three standard errors.
    assert 0.91 <= _coverage(case, 20, FAST) <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("problems", [10, 20, 40])
@pytest.mark.parametrize("case", CASES)
def test_coverage(case, problems):
    coverage = _coverage(case, problems, SLOW)
    print(f"{case}, {problems} problems: {coverage:.3f}")
    assert 0.93 <= coverage <= 0.97


@pytest.mark.slow
@pytest.mark.parametrize("problems", [10, 20, 40])
def test_shares_near_one_are_covered_at_least(problems):
    rng = np.random.default_rng(problems)
    found = [_shares(rng, problems, 0.975) for _ in range(SLOW)]
    coverage = np.mean([e.low <= 0.975 <= e.high for e in found])
    print(f"success .975, {problems} problems: {coverage:.3f}")
    assert coverage >= 0.93


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
