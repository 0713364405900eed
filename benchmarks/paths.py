"""How long a DG-SELECT decision takes, and how the exact sums compare with enumerating all simple paths.

    python -m benchmarks.paths [--repeats 5] [--decisions 20]

Ratios are of two measurements in the same run, so they hold on any machine; times
are this machine's.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice, pairwise

import networkx as nx
import numpy as np
import tyro

from torc.task_planning.dg_select import DgSelectPlanner, decide_by_graph
from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.paths import sink_probabilities
from torc.task_planning.relations import find_relations
from torc.testing.contexts import cluttered_context
from torc.workspace.workspace_files import load_workspace

ENUMERATED_PATHS = 200_000
"""Enumeration stops here; its time is then a lower bound."""


@dataclass(frozen=True)
class Args:
    """Time the exact sums beside an enumeration of all simple paths, then DG-SELECT's decisions."""

    repeats: int = 5
    """How often each call is timed; medians and percentiles are over these."""
    decisions: int = 20
    """Scenes that a decision is timed for, every other one with a hidden target."""


def seconds(call: Callable[[], object], repeats: int) -> np.ndarray:
    """Wall time of each of several calls, after one to warm up."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return np.array(times)


def random_weights(rng: np.random.Generator, n: int, degree: float, sinks: int) -> np.ndarray:
    """A graph with that mean out-degree, node 0 no sink."""
    w = (rng.random((n, n)) < degree / (n - 1)) * rng.uniform(0.05, 1.0, (n, n))
    np.fill_diagonal(w, 0)
    w[1 + rng.choice(n - 1, sinks, replace=False)] = 0
    w[0, 1] += 1e-9
    total = w.sum(axis=1, keepdims=True)
    return np.divide(w, total, out=np.zeros_like(w), where=total > 0)


def enumerate_paths(w: np.ndarray) -> int:
    """Sums path after path as the authors' software does; returns how many paths there were."""
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(w)))
    graph.add_edges_from((int(i), int(j)) for i, j in zip(*np.nonzero(w)))
    sinks = set(np.flatnonzero(~w.any(axis=1)).tolist())
    count = 0
    for path in islice(nx.all_simple_paths(graph, 0, sinks), ENUMERATED_PATHS):
        np.prod([w[a, b] for a, b in pairwise(path)])
        count += 1
    return count


def compare_with_enumeration(repeats: int) -> None:
    print("graph              paths   enumerated      exact sums        ratio")
    for n, degree, sinks in [
        (10, 3, 3),
        (15, 3, 4),
        (15, 5, 4),
        (20, 3, 5),
        (20, 8, 5),
        (30, 4, 8),
        (40, 3, 8),
        (40, 36, 5),
    ]:
        w = random_weights(np.random.default_rng(0), n, degree, sinks)
        fast = float(np.median(seconds(lambda w=w: sink_probabilities(w, 0), repeats)))
        result = sink_probabilities(w, 0)
        start = time.perf_counter()
        paths = enumerate_paths(w)
        slow = time.perf_counter() - start
        more = ">" if paths == ENUMERATED_PATHS else " "
        answer = (
            "" if result.exact else f"  interval up to {max(np.subtract(result.upper, result.lower)):.2g}: "
        )
        print(
            f"{n:2d} nodes, degree {degree:2d} {more}{paths:6d} {more}{1e3 * slow:9.1f} ms {1e3 * fast:9.2f} ms "
            f"{more}{slow / fast:10.0f}x{answer}{result.bound_hit}"
        )


def decision_time(scenes: int, repeats: int) -> None:
    decisions, parts = [], {"relations": [], "graph": [], "choice": []}
    rng = np.random.default_rng(0)
    planner = DgSelectPlanner()
    for seed in range(scenes):
        context = cluttered_context(15, seed, load_workspace().camera, hidden_target=bool(seed % 2))
        decisions.append(seconds(lambda c=context: planner.decide(c, rng), repeats))
        relations = find_relations(context.scene)
        graph = build_dependency_graph(context, relations=relations)
        parts["relations"].append(seconds(lambda c=context: find_relations(c.scene), repeats))
        parts["graph"].append(
            seconds(lambda c=context, r=relations: build_dependency_graph(c, relations=r), repeats)
        )
        parts["choice"].append(seconds(lambda c=context, g=graph: decide_by_graph(g, c), repeats))
    ms = 1e3 * np.concatenate(decisions)
    print(f"\nDG-SELECT, 15 objects at 640x480: median {np.median(ms):.1f} ms (budget 10), p95 "
          f"{np.percentile(ms, 95):.1f} ms (budget 50)")  # fmt: skip
    print(", ".join(f"{name} {1e3 * np.median(np.concatenate(t)):.1f} ms" for name, t in parts.items()))


def main() -> None:
    """Print both comparisons."""
    args = tyro.cli(Args)
    compare_with_enumeration(args.repeats)
    decision_time(args.decisions, args.repeats)


if __name__ == "__main__":
    main()
