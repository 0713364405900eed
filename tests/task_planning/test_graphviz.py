"""Graphs as text."""

from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.graphviz import graph_to_dot
from torc.testing import contexts


def test_dot_text_names_all_nodes_and_edges() -> None:
    graph = build_dependency_graph(contexts.cluttered_context(9, 1, hidden_target=True))
    text = graph_to_dot(graph, {graph.sinks[0]: 0.5}, chosen=graph.sinks[0])
    assert text.count(" -> ") == len(graph.edges)
    assert text.count("fillcolor") == len(graph.nodes)
    assert "p = 0.50" in text
    assert text.count("{") == text.count("}") == 1
