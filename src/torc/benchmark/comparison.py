"""Compare planners on the same problem and seed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from torc.benchmark.intervals import Estimate, Sums, by_problem, difference
from torc.benchmark.rows import Table, TrialRow

ALPHA = 0.05
"""A corrected p below this is called a difference."""
_EXACT_UP_TO = 14
"""Up to this many problems, all 2^n assignments of signs are tried."""
_DRAWS = 20_000
_LEAST_P = 1 / (_DRAWS + 1)
"""The p-value if no random signs make a difference as large: the true one may be far less."""


@dataclass(frozen=True)
class Comparison:
    """Two planners, by label, on the problems and seeds that both completed, `first` minus `second`.

    `p_cost` is the probability of a difference of cost as large as this one between equal planners.
    """

    first: str
    second: str
    pairs: int
    success: Estimate
    cost: Estimate
    drops: Estimate
    p_cost: float

    def p_text(self, p: float) -> str:
        """Return the p-value of cost, as corrected; "<" if no random signs made a difference as large."""
        return ("< " if self.p_cost <= _LEAST_P * (1 + 1e-9) else "") + f"{p:.2g}"


def compare(table: Table, first: str, second: str) -> Comparison:
    """Compare two planners; all values are NaN if they share no trial."""
    ours = {(r.problem, r.seed): r for r in table.completed(first)}
    theirs = {(r.problem, r.seed): r for r in table.completed(second)}
    shared = sorted(ours.keys() & theirs.keys())

    def gap(value: Callable[[TrialRow], float]) -> tuple[Sums, Sums]:
        differences = [float(value(ours[key])) - float(value(theirs[key])) for key in shared]
        sums, totals = by_problem([problem for problem, _ in shared], differences, [1] * len(shared))
        return sums, totals

    cost, drops = gap(lambda r: r.cost), difference(*gap(lambda r: r.drops))
    success = difference(*gap(lambda r: r.solved), largest=1.0)
    return Comparison(first, second, len(shared), success, difference(*cost), drops, sign_flip_p(cost[0]))


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
