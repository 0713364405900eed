"""95 % intervals and tests for trials that come in problems: trials of one problem are alike, problems are the sample.

All intervals are built on the linearised variance of a ratio of sums over problems, with Student's t for their number.
The usual percentile bootstrap over problems contains the truth in 86-94 % of the cases with 10 to 40 problems, and in
fewer for shares near 1; these intervals contain it in 93-97 % (tests/benchmark/test_coverage.py, docs/benchmarking.md).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import log, sqrt

import numpy as np
from jaxtyping import Real
from scipy.stats import skew
from scipy.stats import t as student

LEVEL = 0.95
_NORMAL = 1.959963984540054
ALPHA = 0.05
"""A corrected p below this is called a difference."""
_EXACT_UP_TO = 14
"""Up to this many problems, all 2^n assignments of signs are tried."""
_DRAWS = 20_000
LEAST_P = 1 / (_DRAWS + 1)
"""The p-value if no random signs make a difference as large: the true one may be far less."""
_MAX_CUTS = 400
"""Most distinct values at which a median is searched."""

Sums = Real[np.ndarray, "problems"]


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % interval.

    Attributes:
        value: NaN if there is nothing to count.
        low, high: the interval; infinite or the whole range if there are too few problems.
        count: trials, picks or grasps behind it.
        problems: problems behind it.
    """

    value: float
    low: float
    high: float
    count: int
    problems: int

    def text(self, digits: int | None = 2, sign: str = "") -> str:
        """Return text for tables: "0.83 [0.78, 0.87]"; empty without a value.

        `digits` is None for two significant ones; `sign` is "+" for differences.
        """
        if not np.isfinite(self.value):
            return ""

        def written(value: float) -> str:
            if not np.isfinite(value):
                return "?"
            shorter = ".2g" if abs(value) < 100 else ".0f"
            return format(value, sign + (shorter if digits is None else f".{digits}f"))

        return f"{written(self.value)} [{written(self.low)}, {written(self.high)}]"

    @property
    def short(self) -> str:
        """The value alone, in two significant digits."""
        return self.text(None).partition(" ")[0]


NOTHING = Estimate(float("nan"), float("nan"), float("nan"), 0, 0)


def by_problem(problems: Sequence[str], *columns: Sequence[float]) -> tuple[Sums, ...]:
    """Sum columns over the rows of each problem, problems in alphabetical order."""
    index, count = _numbered(problems)
    # For empty input NumPy counts in whole numbers.
    return tuple(np.bincount(index, np.asarray(c, float), count).astype(float) for c in columns)


def _numbered(problems: Sequence[str]) -> tuple[np.ndarray, int]:
    """Return each row's problem as its place in alphabetical order, and the number of problems."""
    place = {name: i for i, name in enumerate(sorted(set(problems)))}
    return np.fromiter(map(place.__getitem__, problems), np.intp, len(problems)), len(place)


def per_row(rows: Iterable[tuple[str, float]]) -> tuple[Sums, Sums]:
    """Return the sum of the values and the number of rows of each problem, from rows of a problem and a value."""
    pairs = list(rows)
    sums, totals = by_problem([name for name, _ in pairs], [value for _, value in pairs], [1] * len(pairs))
    return sums, totals


def share(hits: Sums, totals: Sums) -> Estimate:
    """Estimate a share: Wilson's interval for the effective number of trials, with Student's t for the problems.

    (The modified Wilson interval for complex surveys of N. Dean and M. Pagano, Evaluating confidence interval methods
    for binomial proportions in clustered surveys, 2015.) If all trials ended alike, their likeness within problems is
    unknown: each problem then counts as one trial.
    """
    hits, totals = _counted(hits, totals)
    if not len(totals):
        return NOTHING
    p, se = ratio(hits, totals)
    spread = p * (1 - p)
    trials = float(totals.sum())
    if 0 < se < np.inf and spread > 0:
        low, high = wilson(p, min(spread / se**2, trials), _quantile(len(totals)))
    else:
        low, high = wilson(p, float(len(totals)), _NORMAL)
    return Estimate(p, min(low, p), max(high, p), int(trials), len(totals))


def mean(sums: Sums, totals: Sums, largest: float = np.inf) -> Estimate:
    """Estimate a mean of numbers that are not negative and may be skewed, such as drops and picks.

    Student's t after the transformation that removes the skewness (P. Hall, On the removal of skewness by
    transformation, 1992). If all problems are equal, others may still differ: as many as may have been missed by
    chance. `largest` is the largest number of a trial.
    """
    sums, totals = _counted(sums, totals)
    if not len(totals):
        return NOTHING
    value, se = ratio(sums, totals)
    count, n = int(totals.sum()), len(totals)
    if n < 2:
        return Estimate(value, 0.0, largest, count, n)
    if value <= 0:  # nothing happened in any problem: the bound for a Poisson count, each problem one look
        return Estimate(0.0, 0.0, min(-log((1 - LEVEL) / 2) / n, largest), count, n)
    if se <= 0:
        missed = _missed(n)
        return Estimate(value, value * (1 - missed), value + (largest - value) * missed, count, n)
    skewed, q = float(skew(sums - value * totals)), _quantile(n)
    low, high = (value - _unskewed(t, skewed, n) * se for t in (q, -q))
    return Estimate(value, max(0.0, low), min(high, largest), count, n)


def difference(sums: Sums, totals: Sums, largest: float = np.inf) -> Estimate:
    """Estimate a mean of paired differences, of either sign: Student's t.

    If no problem shows any difference, others may: as many as may have been missed by chance, each as large as a
    difference can be (`largest`).
    """
    sums, totals = _counted(sums, totals)
    if not len(totals):
        return NOTHING
    value, se = ratio(sums, totals)
    half = _quantile(len(totals)) * se if len(totals) > 1 else np.inf
    if not sums.any():
        half = largest * _missed(len(totals))
    return Estimate(value, value - half, value + half, int(totals.sum()), len(totals))


def median(problems: Sequence[str], values: Sequence[float]) -> Estimate:
    """Estimate a median: the values for which the share of trials not above them may be a half (R. Woodruff, 1952)."""
    if not len(values):
        return NOTHING
    numbers = np.asarray(values, dtype=float)
    index, count = _numbered(problems)
    cuts = np.unique(numbers)
    if len(cuts) > _MAX_CUTS:
        cuts = np.unique(np.quantile(numbers, np.linspace(0, 1, _MAX_CUTS), method="lower"))
    totals = np.bincount(index, minlength=count).astype(float)
    first = np.searchsorted(cuts, numbers)  # The first cut that a number is not above.
    steps = np.bincount(first * count + index, minlength=len(cuts) * count).reshape(len(cuts), count)
    shares = [share(hits, totals) for hits in np.cumsum(steps, axis=0).astype(float)]
    low = next((cut for cut, s in zip(cuts, shares) if s.high >= 0.5), cuts[-1])
    high = next((cut for cut, s in zip(cuts, shares) if s.low >= 0.5), np.inf if count < 2 else cuts[-1])
    return Estimate(float(np.median(numbers)), float(low), float(high), len(numbers), count)


def ratio(sums: Sums, totals: Sums) -> tuple[float, float]:
    """Return a ratio of sums over problems and its linearised standard error; infinite for a single problem."""
    value, n = float(sums.sum() / totals.sum()), len(totals)
    if n < 2:
        return value, np.inf
    residuals = (sums - value * totals) / totals.mean()
    return value, float(sqrt((residuals**2).sum() / (n * (n - 1))))


def _missed(problems: int) -> float:
    """Return the largest share of deviating problems that chance may have missed altogether."""
    return float(1 - ((1 - LEVEL) / 2) ** (1 / problems))


def _unskewed(quantile: float, skewness: float, problems: int) -> float:
    """Return the quantile of (estimate - truth) / error for that skewness: inverts Hall's cubic transformation."""
    a, shifted = skewness / (3 * sqrt(problems)), quantile - skewness / (6 * sqrt(problems))
    return float(np.cbrt(1 + 3 * a * shifted) - 1) / a if abs(a) > 1e-9 else shifted


def wilson(p: float, trials: float, quantile: float) -> tuple[float, float]:
    """Return Wilson's score interval of a share of independent trials, whose number need not be whole."""
    z2 = quantile**2
    middle = (p + z2 / (2 * trials)) / (1 + z2 / trials)
    half = quantile / (1 + z2 / trials) * sqrt(p * (1 - p) / trials + z2 / (4 * trials**2))
    return max(0.0, middle - half), min(1.0, middle + half)


@cache
def _quantile(problems: int) -> float:
    return float(student.ppf(0.5 + LEVEL / 2, problems - 1))


def _counted(sums: Sums, totals: Sums) -> tuple[Sums, Sums]:
    """Leave out the problems without anything to count."""
    some = totals > 0
    return sums[some], totals[some]


def sign_flip_p(sums: Sums) -> float:
    """Return the p-value of a two-sided permutation test: without a difference, each problem's sum could change its
    sign.

    Exact for few problems, else from a fixed set of random signs. NaN without problems.
    """
    if not len(sums):
        return float("nan")
    values = np.asarray(sums, dtype=float)
    values = values[values != 0]  # their sign changes nothing
    if len(values) <= _EXACT_UP_TO:
        signs, extra = np.array(list(product((-1.0, 1.0), repeat=len(values)))), 0
    else:
        signs, extra = np.random.default_rng(0).choice((-1.0, 1.0), (_DRAWS, len(values))), 1
    as_large = np.abs(signs @ values) >= abs(values.sum()) - 1e-9
    return float((as_large.sum() + extra) / (len(signs) + extra))


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number (S. Holm, 1979); NaNs are unchanged and do not count."""
    known = [i for i, p in enumerate(p_values) if np.isfinite(p)]
    corrected, largest = list(p_values), 0.0
    for rank, i in enumerate(sorted(known, key=lambda i: p_values[i])):
        largest = max(largest, min(1.0, (len(known) - rank) * p_values[i]))
        corrected[i] = largest
    return corrected
