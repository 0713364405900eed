"""Sink probabilities against the enumeration of all simple paths."""

from itertools import pairwise

import networkx as nx
import numpy as np
import pytest

from torc.errors import InputError
from torc.task_planning import path_kernels
from torc.task_planning.paths import PathConfig, sink_probabilities, strong_parts, trim


def random_weights(rng: np.random.Generator, n: int, density: float, sinks: int) -> np.ndarray:
    """Rows of random weights that sum to 1; at least `sinks` empty ones."""
    w = (rng.random((n, n)) < density) * rng.uniform(0.05, 1.0, (n, n))
    np.fill_diagonal(w, 0)
    w[rng.choice(n, sinks, replace=False)] = 0
    total = w.sum(axis=1, keepdims=True)
    return np.divide(w, total, out=np.zeros_like(w), where=total > 0)


def enumerate_paths(w: np.ndarray, source: int) -> dict[int, float]:
    """The sums, one simple path after another."""
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(w)))
    graph.add_edges_from((int(i), int(j)) for i, j in zip(*np.nonzero(w)))
    sums = {}
    for sink in np.flatnonzero(~w.any(axis=1)).tolist():
        if sink == source:
            sums[sink] = 1.0
            continue
        sums[sink] = 0.0
        for path in nx.all_simple_paths(graph, source, sink):
            sums[sink] += float(np.prod([w[a, b] for a, b in pairwise(path)]))
    return sums


def graphs(count: int, largest: int):
    """Random graphs from sparse to dense, many with cycles."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        n = int(rng.integers(2, largest + 1))
        # Enumeration of dense graphs takes minutes beyond ten nodes, so the densest are smaller.
        density = rng.uniform(0.08, 0.9 if n <= 8 else 0.45)
        yield random_weights(rng, n, density, int(rng.integers(0, max(1, n // 3) + 1)))


@pytest.mark.parametrize(
    "config", [PathConfig(), PathConfig(subset_nodes=0)], ids=["default", "never by subsets"]
)
def test_equals_enumeration_on_a_thousand_graphs(config: PathConfig) -> None:
    cyclic = 0
    for w in graphs(1000, 12):
        result = sink_probabilities(w, 0, config)
        expected = enumerate_paths(w, 0)
        assert result.exact
        assert result.lower == result.upper
        assert dict(zip(result.sinks, result.lower)) == pytest.approx(expected, abs=1e-9)
        cyclic += not nx.is_directed_acyclic_graph(nx.from_numpy_array(w, create_using=nx.DiGraph))
    assert cyclic > 250


def test_bounds_hold_when_work_is_scarce() -> None:
    inexact = 0
    for k, w in enumerate(graphs(300, 9)):
        result = sink_probabilities(w, 0, PathConfig(work_limit=1 + k % 12, subset_nodes=0))
        expected = enumerate_paths(w, 0)
        for sink, low, high in zip(result.sinks, result.lower, result.upper):
            assert low - 1e-12 <= expected[sink] <= high + 1e-12
        if result.exact:
            assert result.bound_hit == ""
            continue
        inexact += 1
        assert "work limit" in result.bound_hit
        # Of a probability of 1, no sink can have more than the others leave.
        lower = np.array(result.lower)
        assert np.all(np.array(result.upper) <= np.maximum(1.0 - (lower.sum() - lower), lower) + 1e-9)
        best = max(result.sinks, key=lambda s: result[s], default=None)
        if result.decided_among(result.sinks) and best is not None:
            assert expected[best] == pytest.approx(max(expected.values()), abs=1e-12)
    assert inexact > 30


def test_three_kernels_agree_on_one_part() -> None:
    rng = np.random.default_rng(3)
    for n in (2, 5, 9, 11):
        w = random_weights(rng, n, 0.6, 0) * 0.8
        successors = np.array([sum(1 << int(j) for j in np.flatnonzero(row)) for row in w], dtype=np.uint64)
        predecessors = np.array(
            [sum(1 << int(j) for j in np.flatnonzero(row)) for row in w.T], dtype=np.uint64
        )
        entry = rng.random(n) / n
        every = np.uint64((1 << n) - 1)
        by_subsets, _ = path_kernels.subset_sums(w, successors, entry)
        merged, waiting, _ = path_kernels.merged_sums(
            w, successors, predecessors, every, entry, 10**9, 1 << 16
        )
        best, left, _ = path_kernels.best_first_sums(w, successors, predecessors, every, entry, 3_000_000)
        assert not waiting.any()
        np.testing.assert_allclose(merged, by_subsets, atol=1e-12)
        np.testing.assert_allclose(best, by_subsets, atol=left.sum() * n + 1e-12)


def test_forty_dense_nodes_answer_within_the_work_limit_and_say_so() -> None:
    w = random_weights(np.random.default_rng(0), 40, 0.9, 5)
    source = int(np.flatnonzero(w.any(axis=1))[0])
    config = PathConfig()
    result = sink_probabilities(w, source, config)
    assert not result.exact
    assert "work limit" in result.bound_hit
    assert result.work <= config.work_limit + 2 * 40
    assert 0 < sum(result.lower) <= 1
    assert all(low <= high for low, high in zip(result.lower, result.upper))


def test_more_work_never_widens_the_interval() -> None:
    w = random_weights(np.random.default_rng(1), 26, 0.5, 4)
    gaps = []
    for limit in (500, 5_000, 50_000):
        result = sink_probabilities(w, int(np.flatnonzero(w.any(axis=1))[0]), PathConfig(work_limit=limit))
        gaps.append(max(np.subtract(result.upper, result.lower)))
    assert gaps[0] >= gaps[1] >= gaps[2]


def test_forty_sparse_nodes_are_exact_by_renumbering() -> None:
    rng = np.random.default_rng(5)
    for _ in range(5):
        w = random_weights(rng, 40, 0.07, 8)
        source = int(np.flatnonzero(w.any(axis=1))[0])
        order = rng.permutation(40)
        result = sink_probabilities(w, source)
        other = sink_probabilities(w[np.ix_(order, order)], int(np.flatnonzero(order == source)[0]))
        assert result.exact
        assert other.exact
        for sink, p in zip(result.sinks, result.lower):
            assert other[int(np.flatnonzero(order == sink)[0])] == pytest.approx(p, abs=1e-12)


def test_a_cycle_without_a_way_out_loses_mass() -> None:
    w = np.zeros((4, 4))
    w[0, 1], w[0, 3] = 0.25, 0.75
    w[1, 2] = w[2, 1] = 1.0
    result = sink_probabilities(w, 0)
    assert result.sinks == (3,)
    assert result[3] == pytest.approx(0.75)
    assert result.lost == pytest.approx(0.25)


def test_a_cycle_larger_than_the_masks_still_has_bounds() -> None:
    n = 70
    w = np.zeros((n + 1, n + 1))
    for i in range(n):
        w[i, (i + 1) % n], w[i, (i + 9) % n] = 0.45, 0.45
    w[1:n, n] = 0.1
    w[0] /= w[0].sum()
    result = sink_probabilities(w, 0)
    assert not result.exact
    assert "larger than" in result.bound_hit
    assert result.lower[0] <= result.upper[0] <= 1


def test_trimming_keeps_the_sums_and_drops_edges() -> None:
    dropped = 0
    for w in graphs(200, 8):
        sinks = np.flatnonzero(~w.any(axis=1)).tolist()
        trimmed = trim(w, 0, sinks)
        dropped += np.count_nonzero(w) - np.count_nonzero(trimmed)
        expected = enumerate_paths(w, 0)
        kept = enumerate_paths(trimmed, 0)
        assert {s: kept[s] for s in expected if s != 0} == pytest.approx(
            {s: p for s, p in expected.items() if s != 0}, abs=1e-12
        )
    assert dropped > 1000


def test_strong_parts_are_networkx_ones_in_topological_order() -> None:
    for w in graphs(100, 10):
        graph = nx.from_numpy_array(w, create_using=nx.DiGraph)
        parts = strong_parts(w, (1 << len(w)) - 1)
        assert {frozenset(p) for p in parts} == {
            frozenset(p) for p in nx.strongly_connected_components(graph)
        }
        place = {v: i for i, part in enumerate(parts) for v in part}
        assert all(place[a] <= place[b] for a, b in graph.edges)


@pytest.mark.usefixtures("any_arrays")
@pytest.mark.parametrize(
    "weights",
    [np.full((2, 2), 0.9), np.array([[0, -0.1], [0, 0]]), np.array([[0, np.nan], [0, 0]]), np.ones((2, 3))],
)
def test_bad_weights_are_refused(weights: np.ndarray) -> None:
    with pytest.raises(InputError):
        sink_probabilities(weights, 0)


def test_bad_limits_are_refused() -> None:
    with pytest.raises(InputError):
        PathConfig(work_limit=0)
    with pytest.raises(InputError):
        PathConfig(state_capacity=1000)
