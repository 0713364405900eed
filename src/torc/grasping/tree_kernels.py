"""Evaluation of boosted trees: node by node, and faster with all tests sorted by feature and threshold."""

from typing import NamedTuple

import numpy as np
from numba import njit

_MAX_LEAVES = 64
_DE_BRUIJN = 0x03F79D71B4CB0A89
"""Multiplied with a single bit, its top six bits tell which bit it is."""


class SortedTests(NamedTuple):
    """Trees as tests. A test that fails (feature > threshold) rules out the leaves to its left.

    Attributes:
        starts: first test of each feature, and the number of tests at the end; thresholds rise within a feature.
        thresholds, trees: of each test.
        masks: leaves that stay possible if the test fails, bit k for the tree's k-th leaf from the left.
        leaf_starts: first leaf of each tree.
        leaf_values: of all leaves, from left to right.
        bit_index: which bit a De Bruijn product stands for.
    """

    starts: np.ndarray
    thresholds: np.ndarray
    trees: np.ndarray
    masks: np.ndarray
    leaf_starts: np.ndarray
    leaf_values: np.ndarray
    bit_index: np.ndarray


def sorted_tests(
    feature: np.ndarray,
    threshold: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
    value: np.ndarray,
    roots: np.ndarray,
) -> SortedTests | None:
    """Trees in the form for `evaluate_sorted`; None if one has more than 64 leaves."""
    leaf_starts: list[int] = []
    leaf_values: list[float] = []
    tests: list[tuple[int, float, int, int]] = []
    for t, root in enumerate(roots):
        first = len(leaf_values)
        leaf_starts.append(first)
        # Depth first, left before right; a node is met again once its left side is done.
        stack: list[tuple[int, int]] = [(int(root), -1)]
        while stack:
            node, before = stack.pop()
            if before >= 0:
                gone = ((1 << (len(leaf_values) - first)) - 1) & ~((1 << before) - 1)
                mask = ~gone & (2**_MAX_LEAVES - 1)
                tests.append((int(feature[node]), float(threshold[node]), t, mask))
            elif feature[node] < 0:
                leaf_values.append(float(value[node]))
            else:
                stack += [(int(right[node]), -1), (node, len(leaf_values) - first), (int(left[node]), -1)]
        if len(leaf_values) - first > _MAX_LEAVES:
            return None
    tests.sort()
    columns = np.array([f for f, *_ in tests], dtype=np.int64)
    bit_index = np.zeros(64, dtype=np.int64)
    for k in range(64):
        bit_index[((_DE_BRUIJN << k) & (2**64 - 1)) >> 58] = k
    return SortedTests(
        np.searchsorted(columns, np.arange(int(columns.max(initial=-1)) + 2)),
        np.array([x for _, x, _, _ in tests], dtype=float),
        np.array([t for _, _, t, _ in tests], dtype=np.int64),
        np.array([m for *_, m in tests], dtype=np.uint64),
        np.array(leaf_starts, dtype=np.int64),
        np.array(leaf_values, dtype=float),
        bit_index,
    )


@njit(cache=True)
def evaluate_sorted(
    features: np.ndarray,
    starts: np.ndarray,
    thresholds: np.ndarray,
    trees: np.ndarray,
    masks: np.ndarray,
    leaf_starts: np.ndarray,
    leaf_values: np.ndarray,
    bit_index: np.ndarray,
    baseline: float,
) -> np.ndarray:
    """Log-odds per row, for rows without NaN; the same sums as `evaluate_trees`, some times faster.

    Along each feature's rising thresholds the failing tests come first: each strikes leaves off its tree, and
    the first leaf left is the one a walk would end in (Lucchese et al., QuickScorer, 2015).
    """
    out = np.full(len(features), baseline)
    possible = np.empty(len(leaf_starts), dtype=np.uint64)
    everything = ~np.uint64(0)
    for i in range(len(features)):
        possible[:] = everything
        for f in range(len(starts) - 1):
            x = features[i, f]
            for k in range(starts[f], starts[f + 1]):
                if x <= thresholds[k]:
                    break
                possible[trees[k]] &= masks[k]
        for t in range(len(leaf_starts)):
            first = possible[t] & (~possible[t] + np.uint64(1))
            index = (first * np.uint64(_DE_BRUIJN)) >> np.uint64(58)
            out[i] += leaf_values[leaf_starts[t] + bit_index[index]]
    return out


@njit(cache=True)
def evaluate_trees(
    features: np.ndarray,
    feature: np.ndarray,
    threshold: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
    value: np.ndarray,
    missing_left: np.ndarray,
    roots: np.ndarray,
    baseline: float,
) -> np.ndarray:
    """Log-odds per row: the baseline and the leaf values of all trees."""
    out = np.full(len(features), baseline)
    for t in range(len(roots)):
        for i in range(len(features)):
            node = roots[t]
            while feature[node] >= 0:
                x = features[i, feature[node]]
                go_left = missing_left[node] if np.isnan(x) else x <= threshold[node]
                node = left[node] if go_left else right[node]
            out[i] += value[node]
    return out
