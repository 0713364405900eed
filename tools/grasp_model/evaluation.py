"""Measures of a grasp score, with intervals."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int64

from torc.benchmark import intervals

Z_95 = 1.959963984540054
_EPSILON = 1e-6
_DRAWS = 2000


@dataclass(frozen=True)
class Share:
    """A share with its 95 % interval.

    Attributes:
        value: successes over trials; NaN without trials.
        low, high: the interval.
        count: trials.
    """

    value: float
    low: float
    high: float
    count: int

    def __str__(self) -> str:
        if not self.count:
            return "-"
        return f"{100 * self.value:.1f} % [{100 * self.low:.1f}, {100 * self.high:.1f}]"


def wilson(successes: int, count: int) -> Share:
    """Share of independent trials with Wilson's score interval."""
    if count == 0:
        return Share(float("nan"), 0.0, 1.0, 0)
    p = successes / count
    low, high = intervals.wilson(p, count, Z_95)
    return Share(p, min(low, p), max(high, p), count)


def clustered_share(
    held: Bool[np.ndarray, "n"], cluster: Int64[np.ndarray, "n"], rng: np.random.Generator
) -> Share:
    """Share with a bootstrap interval over clusters, as objects of one scene are not independent.

    Where all outcomes are equal the bootstrap has no width; Wilson's interval over the clusters stands in.
    """
    if len(held) == 0:
        return wilson(0, 0)
    if held.all() or not held.any():
        n = len(np.unique(cluster))
        bound = wilson(n if held.all() else 0, n)
        return Share(float(held.mean()), bound.low, bound.high, len(held))
    return _bootstrapped(held.astype(float), cluster, rng)


def paired_difference(
    a: Bool[np.ndarray, "n"],
    b: Bool[np.ndarray, "n"],
    cluster: Int64[np.ndarray, "n"],
    rng: np.random.Generator,
) -> Share:
    """Mean of a - b over the same objects, bootstrapped over clusters."""
    if len(a) == 0:
        return wilson(0, 0)
    return _bootstrapped(a.astype(float) - b.astype(float), cluster, rng)


def _bootstrapped(
    values: Float[np.ndarray, "n"], cluster: Int64[np.ndarray, "n"], rng: np.random.Generator
) -> Share:
    """The mean; whole clusters are drawn."""
    _, index = np.unique(cluster, return_inverse=True)
    n = int(index.max()) + 1
    sums, totals = np.bincount(index, values, n), np.bincount(index, minlength=n)
    pick = rng.integers(0, n, (_DRAWS, n))
    low, high = np.quantile(sums[pick].sum(axis=1) / totals[pick].sum(axis=1), [0.025, 0.975])
    return Share(float(values.mean()), float(low), float(high), len(values))


def auc(p: Float[np.ndarray, "n"], held: Bool[np.ndarray, "n"]) -> float:
    """Area under the ROC curve: how often a held grasp outranks a failed one, ties half. NaN for one class."""
    n_held = int(held.sum())
    n_failed = len(held) - n_held
    if n_held == 0 or n_failed == 0:
        return float("nan")
    _, index, counts = np.unique(p, return_inverse=True, return_counts=True)
    middle_rank = np.cumsum(counts) - (counts - 1) / 2
    return float((middle_rank[index][held].sum() - n_held * (n_held + 1) / 2) / (n_held * n_failed))


def log_loss(p: Float[np.ndarray, "n"], held: Bool[np.ndarray, "n"]) -> float:
    """Mean negative log likelihood, nats."""
    q = np.clip(p, _EPSILON, 1 - _EPSILON)
    return float(-np.mean(np.where(held, np.log(q), np.log1p(-q))))


def brier(p: Float[np.ndarray, "n"], held: Bool[np.ndarray, "n"]) -> float:
    """Mean squared error of the probability."""
    return float(np.mean((p - held) ** 2))


@dataclass(frozen=True)
class ReliabilityBin:
    """Trials whose predicted probability lies in [low, high)."""

    low: float
    high: float
    mean_p: float
    held: Share


BIN_EDGES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)


def reliability(
    p: Float[np.ndarray, "n"], held: Bool[np.ndarray, "n"], edges: tuple[float, ...] = BIN_EDGES
) -> list[ReliabilityBin]:
    """Predicted against observed, bin by bin; empty bins are left out."""
    bins = []
    for low, high in pairwise(edges):
        inside = (p >= low) & ((p < high) | (high >= 1.0))
        if inside.any():
            share = wilson(int(held[inside].sum()), int(inside.sum()))
            bins.append(ReliabilityBin(low, high, float(p[inside].mean()), share))
    return bins


def calibration_error(p: Float[np.ndarray, "n"], held: Bool[np.ndarray, "n"]) -> float:
    """Expected calibration error over the bins of `reliability`."""
    return sum(b.held.count * abs(b.mean_p - b.held.value) for b in reliability(p, held)) / max(len(p), 1)


def best_per_group(p: Float[np.ndarray, "n"], group: Int64[np.ndarray, "n"]) -> np.ndarray:
    """Index of the row with the highest p in each group, groups in rising order; ties by the first row."""
    order = np.lexsort((np.arange(len(p)), -p, group))
    _, first = np.unique(group[order], return_index=True)
    return order[first]


def permutation_importance(
    predict: Callable[[np.ndarray], np.ndarray],
    features: np.ndarray,
    held: Bool[np.ndarray, "n"],
    rng: np.random.Generator,
    repeats: int = 3,
) -> Float[np.ndarray, "f"]:
    """Loss of AUC when one feature is shuffled, per feature."""
    base = auc(predict(features), held)
    loss = np.zeros(features.shape[1])
    for j in range(features.shape[1]):
        shuffled = features.copy()
        for _ in range(repeats):
            shuffled[:, j] = rng.permutation(features[:, j])
            loss[j] += (base - auc(predict(shuffled), held)) / repeats
    return loss
