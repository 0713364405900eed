"""The dependency graph as a record: what it refuses, and that JSON brings it back."""

import json

import pytest

from torc.errors import InputError
from torc.task_planning.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind
from torc.task_planning.graph_building import build_dependency_graph
from torc.testing import contexts


@pytest.mark.parametrize("seed", range(8))
def test_weights_sum_to_one_and_json_brings_the_graph_back(seed: int) -> None:
    context = contexts.cluttered_context(12, seed, hidden_target=bool(seed % 2))
    graph = build_dependency_graph(context)
    sums = graph.weight_matrix().sum(axis=1)
    for node_id, total in zip(graph.ids, sums):
        assert total == pytest.approx(0.0 if node_id in graph.sinks else 1.0)
    assert DependencyGraph.from_dict(json.loads(json.dumps(graph.to_dict()))) == graph


@pytest.mark.parametrize(
    "edges",
    [
        (DependencyEdge(0, 9, EdgeKind.BELOW, 1.0),),
        (DependencyEdge(0, 0, EdgeKind.BELOW, 1.0),),
        (DependencyEdge(0, 1, EdgeKind.BELOW, 0.5),),
        (DependencyEdge(0, 1, EdgeKind.BELOW, 0.5), DependencyEdge(0, 1, EdgeKind.BEHIND, 0.5)),
    ],
)
def test_broken_graphs_are_refused(edges: tuple[DependencyEdge, ...]) -> None:
    with pytest.raises(InputError):
        DependencyGraph((DependencyNode(0), DependencyNode(1)), edges, 0)


@pytest.mark.parametrize(
    "change", [{"version": 99}, {"nodes": 3}, {"edges": [{"source": 0}]}, {"target": 77}]
)
def test_broken_files_are_refused(change: dict) -> None:
    data = build_dependency_graph(contexts.stacked_context()).to_dict()
    with pytest.raises(InputError):
        DependencyGraph.from_dict(data | change)
