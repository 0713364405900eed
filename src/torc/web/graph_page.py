"""The dependency graph with places for its nodes, as the page draws it."""

from collections.abc import Mapping
from typing import Any

from torc.errors import InputError
from torc.perception.palette import object_color
from torc.records import MAX_OBJECTS
from torc.task_planning.graph import DependencyGraph
from torc.task_planning.layout import lay_out

MAX_EDGES = 1500


def graph_page(data: Mapping[str, Any], probabilities: Mapping[str, float]) -> dict[str, Any] | None:
    """A graph as `DependencyGraph.to_dict` made it, laid out; None if it is none, or too large to draw.

    `probabilities` are p(sink) by id, as text.
    """
    try:
        if len(data["nodes"]) > MAX_OBJECTS + 1 or len(data["edges"]) > MAX_EDGES:
            return None
        graph = DependencyGraph.from_dict(data)
        layout = lay_out(graph)
        nodes = []
        for n in graph.nodes:
            p = probabilities.get(str(n.id)) if isinstance(probabilities, Mapping) else None
            known = isinstance(p, int | float) and 0 <= p <= 1
            facts = {"id": n.id, "color": hex_color(n.id), "hidden": n.hidden, "graspable": n.graspable}
            nodes.append({**facts, "place": layout.places[n.id], "p": p if known else None})
        edges = [
            edge | {"route": layout.routes[edge["source"], edge["target"]]}
            for edge in graph.to_dict()["edges"]
        ]
    except (InputError, KeyError, TypeError, AttributeError):
        return None
    size = {"columns": layout.columns, "rows": layout.rows}
    return {"target": graph.target, **size, "nodes": nodes, "edges": edges}


def hex_color(object_id: int) -> str:
    """The color of an object in the marked image."""
    return "#{:02x}{:02x}{:02x}".format(*object_color(object_id))
