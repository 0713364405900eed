"""Intervals contain the truth as often as they claim: 1,000 benchmarks with known truth, 10 to 40 problems.

The problems are alike within and differ between as the paper's do: success rates with an intraclass correlation about
.1 (.06-.16 there), drops and picks with the spread of its table. Allowed is 93-97 %; a share near 1 may be covered
more often, since a share of few trials can only take few values.
"""

import numpy as np
import pytest

from torc.benchmark.intervals import difference, mean, median, share

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
