"""Pictures of graphs: every object is there, in its colour, and nothing falls off the page."""

from itertools import pairwise

import numpy as np
import pytest

from torc.drawing.graph_layout import lay_out
from torc.drawing.graph_picture import draw_decision, draw_graph
from torc.drawing.palette import object_color
from torc.records import Decision
from torc.task_planning.dg_select import DgSelectPlanner, graph_probabilities
from torc.task_planning.graph_building import build_dependency_graph
from torc.testing import contexts


def graph_of(objects: int, seed: int, hidden: bool):
    return build_dependency_graph(contexts.cluttered_context(objects, seed, hidden_target=hidden))


def test_picture_shows_every_object_in_its_color() -> None:
    graph = graph_of(12, 2, False)
    p = graph_probabilities(graph)
    image = draw_graph(graph, {k: p[k] for k in p.sinks}, chosen=graph.sinks[0])
    assert image.dtype == np.uint8
    for node in graph.nodes:
        assert np.count_nonzero((image == object_color(node.id)).all(axis=-1)) > 200
    assert (image[[0, -1]] == 255).all()
    assert (image[:, [0, -1]] == 255).all()


def test_chosen_object_changes_only_its_own_surroundings() -> None:
    graph = graph_of(8, 3, True)
    plain, ringed = draw_graph(graph), draw_graph(graph, chosen=graph.sinks[-1])
    assert 0 < (plain != ringed).any(axis=-1).mean() < 0.05


def test_a_lone_hidden_target_can_be_drawn() -> None:
    graph = build_dependency_graph(contexts.empty_context())
    assert (draw_graph(graph, {0: 1.0}) < 100).any()


def test_a_decision_is_drawn_if_it_rests_on_a_graph() -> None:
    context = contexts.cluttered_context(8, 3)
    decision = DgSelectPlanner().decide(context, np.random.default_rng(0))
    drawn = draw_graph(
        build_dependency_graph(context), decision.evidence.probabilities, chosen=decision.object_id
    )
    np.testing.assert_array_equal(draw_decision(decision), drawn)
    assert draw_decision(Decision(None, "no graph")) is None


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
