"""Places of the nodes: none on top of another, every edge from row to row."""

from itertools import pairwise

import numpy as np
import pytest

from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.layout import lay_out
from torc.testing import contexts


def graph_of(objects: int, seed: int, hidden: bool):
    return build_dependency_graph(contexts.cluttered_context(objects, seed, hidden_target=hidden))


@pytest.mark.parametrize(
    ("objects", "seed", "hidden"), [(5, 1, False), (12, 2, True), (20, 3, True), (20, 4, False)]
)
def test_layout_keeps_nodes_apart_and_the_target_on_top(objects: int, seed: int, hidden: bool) -> None:
    graph = graph_of(objects, seed, hidden)
    layout = lay_out(graph)
    places = np.array([layout.places[k] for k in graph.ids])
    gaps = np.abs(places[:, None] - places[None])
    same_row = (gaps[..., 1] == 0) & ~np.eye(len(places), dtype=bool)
    assert gaps[..., 0][same_row].min(initial=1.0) > 0.99
    assert layout.places[graph.target][1] == 0
    assert sum(row == 0 for _, row in layout.places.values()) == 1
    assert places.min() >= 0
    assert places[:, 0].max() <= layout.columns - 1 + 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_routes_join_their_ends_row_by_row(seed: int) -> None:
    graph = graph_of(15, seed, bool(seed % 2))
    layout = lay_out(graph)
    for edge in graph.edges:
        route = layout.routes[(edge.source, edge.target)]
        assert route[0] == layout.places[edge.source]
        assert route[-1] == layout.places[edge.target]
        assert all(abs(b[1] - a[1]) == 1 for a, b in pairwise(route))
